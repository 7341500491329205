"""The options of `automax panel` and `automax run --panel`, and the panel that they ask for."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from automax_ros.cli.options.values import whole_number
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UsageError

if TYPE_CHECKING:
    from automax_ros.panel.security import PanelOptions
    from automax_ros.panel.source import Source

_MOST_PORT = 65_535
_NEEDED = "websockets"
_NAME = r"[A-Za-z0-9._-]{1,253}(:[0-9]{1,5})?|\[[0-9a-fA-F:]+\](:[0-9]{1,5})?"


def add_panel_arguments(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    """Add the options of the panel; ``optional``: with ``--panel``, without which it is not served."""
    group = parser.add_argument_group("panel", "the page in the browser (docs/howto/panel.md)")
    if optional:
        group.add_argument(
            "--panel", action="store_true", help="show the rack in the browser: prints an address to open"
        )
    group.add_argument(
        "--operate", action="store_true", help="let the page operate the rack, which needs `operator: true` in its file"
    )
    group.add_argument(
        "--port",
        type=_port,
        metavar="N",
        help="serve at this port, 0: any free one (default: the first free from 8470 on)",
    )
    group.add_argument(
        "--host", metavar="ADDRESS", help="serve at this address of the machine (default: 127.0.0.1, for itself alone)"
    )
    group.add_argument(
        "--allow-host",
        action="append",
        default=[],
        dest="allow_hosts",
        metavar="NAME",
        help="a name by which browsers on other machines ask for the panel; may be given again",
    )
    group.add_argument(
        "--open",
        action="store_true",
        dest="open_browser",
        help="open the page in a browser, whose command line shows the address to other users of this machine",
    )
    parser.set_defaults(panel=not optional)


@dataclass(frozen=True)
class WantedPanel:
    """A panel that the command line asks for; ``opens``: in a browser, at once."""

    options: PanelOptions
    opens: bool


def wanted_panel(arguments: argparse.Namespace) -> WantedPanel | None:
    """Return the panel that the options describe, None without ``--panel`` where it is optional.

    Raises:
        UsageError: an option is wrong or of no use, or the package that serves it is not installed.
    """
    if not arguments.panel:
        _refuse_options(arguments)
        return None
    try:
        from automax_ros.panel.security import LOOPBACK, PanelOptions
    except ImportError as error:
        if str(error.name).partition(".")[0] != _NEEDED:
            raise
        raise UsageError(f"the panel needs the package {_NEEDED}", "pip install 'automax_ros[panel]'") from error
    names = [str(name).strip() for name in arguments.allow_hosts]
    for name in names:
        if not re.fullmatch(_NAME, name):
            raise UsageError(f"--allow-host {quoted(name)} is not the name of a host", "for example pc7.plant.example")
    host = LOOPBACK[0] if arguments.host is None else arguments.host.strip()
    if not host:
        raise UsageError("--host needs an address", "for example --host 0.0.0.0, all of this machine")
    if host not in LOOPBACK and not names:
        raise UsageError(
            f"--host {host} needs the names by which browsers ask for it", "give each by --allow-host NAME"
        )
    options = PanelOptions(arguments.port, host, tuple(names), arguments.operate)
    return WantedPanel(options, arguments.open_browser)


def _refuse_options(arguments: argparse.Namespace) -> None:
    given = {
        "--operate": arguments.operate,
        "--port": arguments.port is not None,
        "--host": arguments.host is not None,
        "--allow-host": arguments.allow_hosts,
        "--open": arguments.open_browser,
    }
    for option in (option for option, is_given in given.items() if is_given):
        raise UsageError(f"{option} belongs to --panel")


@contextmanager
def panel_served(source: Source, wanted: WantedPanel, message: Callable[[str], None]) -> Iterator[None]:
    """Serve a source while the block lasts; ``message`` tells the address. The source is closed in any case.

    Raises:
        UsageError: the port is taken, or the host is none of this machine.
        UserError: the source cannot be shown.
    """
    from automax_ros.panel.security import LOOPBACK
    from automax_ros.panel.server import PanelServer

    server = PanelServer(source, wanted.options)
    try:
        server.start()
        message(f"panel: {server.address}")
        if wanted.options.host not in LOOPBACK:
            what = "operate the rack" if wanted.options.operate else "see all of it"
            message(f"warning: other machines reach it, unencrypted: who reads what passes can {what}")
        if wanted.opens:
            import webbrowser

            webbrowser.open(server.address)
        yield
    finally:
        server.close()


def _port(text: str) -> int:
    found = whole_number(text)
    if not 0 <= found <= _MOST_PORT:
        raise argparse.ArgumentTypeError(f"{text} is not a port: give 0 to {_MOST_PORT}")
    return found
