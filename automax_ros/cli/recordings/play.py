"""Send the messages of a recording again, as they were sent, for dashboards and other robot stacks.

All topics are sent at the pace of the recording (--rate), with their recorded quality of service; /clock follows the
recording's time. Recordings of other programs play too, as far as their message types are installed. The node `player`
has the services ~/pause and ~/resume. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.cli.options.ros import add_ros_arguments, prepare_ros, ros_arguments
from automax_ros.cli.options.values import add_window_arguments, option_number, window_of
from automax_ros.cli.output.screen import ProgressBar, StatusLine
from automax_ros.cli.output.signals import StopRequest, stop_signals
from automax_ros.core.text import count_of, did_you_mean, printable, quoted
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.playback import NOT_CHOSEN, PlayableRecording, Renaming, choose, survey

if TYPE_CHECKING:
    from automax_ros.ros.clients.player import Player
    from automax_ros.ros.setup.arguments import RosArguments

MAX_RATE = 1000
_SPACE = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*){0,7}/?")
_SIMPLE = re.compile(r"(/[A-Za-z0-9_]{1,64}){1,4}")
_PERMILLE = 1000
_SKIPPED_NAMED = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax play``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    parser.add_argument("--rate", "-r", default="1", metavar="R", help=f"pace, up to {MAX_RATE} times the recorded one")
    add_window_arguments(parser)
    parser.add_argument("--loop", action="store_true", help="begin again at the end, until Ctrl-C")
    parser.add_argument(
        "--clock", action=argparse.BooleanOptionalAction, default=True, help="send /clock (default: yes)"
    )
    parser.add_argument(
        "--topics",
        action="append",
        metavar="T,U",
        help="play these topics only, * stands for anything: '/pm1/common/*'; may be given again",
    )
    parser.add_argument("--namespace", metavar="NS", help="play into this namespace in place of the rack's")
    parser.add_argument("--start-paused", action="store_true", help="wait for the service ~/resume")
    parser.add_argument("--force", action="store_true", help="play even where a rack of this name is live")
    add_ros_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Play the recording; 0 at its end or after Ctrl-C."""
    with stop_signals() as stop:
        rate = _rate(arguments.rate)
        window_of(arguments)
        target = _namespace(arguments.namespace)
        domain = prepare_ros(arguments)
        ros = ros_arguments(arguments)
        found = _survey(arguments.bag, arguments.start, arguments.end, stop)
        if found is None:
            return 0
        _choose(found, arguments.topics)
        renaming = Renaming(found.spaces, target or _target_namespace(found.spaces, ros))
        return _play(found, renaming, rate, arguments, stop, domain)


def _survey(bag: Path, begin: int | None, end: int | None, stop: StopRequest) -> PlayableRecording | None:
    """Read the recording once, so that none of a damaged one is played; None if a signal comes."""
    with ProgressBar(f"reading {bag.name}", _PERMILLE) as bar:
        found = survey(bag, begin, end, lambda done: bar.show(int(_PERMILLE * done)), lambda: stop.requested)
    return None if stop.requested else found


def _choose(found: PlayableRecording, texts: list[str] | None) -> None:
    if texts is None:
        return
    patterns = [item.strip() for text in texts for item in text.split(",") if item.strip()]
    for pattern in choose(found, patterns):
        names = ", ".join(sorted(found.topics)[:5])
        hint = did_you_mean(pattern, found.topics) or f"there are {names}{' ...' if len(found.topics) > 5 else ''}"
        raise UsageError(f"--topics: the recording has no topic {quoted(pattern)}", hint)


def _play(
    found: PlayableRecording,
    renaming: Renaming,
    rate: float,
    arguments: argparse.Namespace,
    stop: StopRequest,
    domain: int,
) -> int:
    from automax_ros.ros.clients.player import Player

    with nullcontext() if arguments.force else _locks(found, renaming, domain):
        player = Player(found, renaming, rate, clock=arguments.clock, arguments=ros_arguments(arguments))
        try:
            return _Show(found, player, stop, domain).play(arguments)
        finally:
            player.close()


@contextmanager
def _locks(found: PlayableRecording, renaming: Renaming, domain: int) -> Iterator[None]:
    """Lock the names of these racks on this host while the block lasts."""
    from contextlib import ExitStack

    from automax_ros.ros.setup.lock import InstanceLock, LockError, RackAlreadyRuns

    with ExitStack() as stack:
        for space in (renaming.space(item) for item in found.spaces):
            if not _SIMPLE.fullmatch(space):
                continue
            try:
                stack.enter_context(InstanceLock(space[1:], domain))
            except RackAlreadyRuns as error:
                raise UsageError(str(error).split(":", 1)[0], _LIVE_HINT) from error
            except LockError as error:
                raise UsageError(str(error)) from error
        yield


_LIVE_HINT = "stop it, play elsewhere with --namespace, or mix both with --force"


class _Show:
    def __init__(self, found: PlayableRecording, player: Player, stop: StopRequest, domain: int) -> None:
        self._found, self._player, self._stop, self._domain = found, player, stop, domain
        self._line = StatusLine()
        self._shown = 0
        self._paused = False

    def play(self, arguments: argparse.Namespace) -> int:
        player = self._player
        player.open()
        playable = self._report_skipped()
        if not playable:
            raise BagError("AMX6840", self._found.bag.path, "no topic of the recording can be played")
        for space in player.look_around(lambda: self._stop.requested, for_racks=not arguments.force):
            raise UsageError(f"rack {space} is live in ROS domain {self._domain}", _LIVE_HINT)
        if player.clock_taken:
            self._line.message("warning: another node sends /clock too; --no-clock leaves it alone")
        span = f"{self._seconds(self._found.begin):.3f} to {self._seconds(self._found.end):.3f} s"
        self._line.message(
            f"playing {count_of(playable, 'topic')}, {span} of the run, as node {player.name} in domain {self._domain};"
            " Ctrl-C ends it"
        )
        player.paused = arguments.start_paused
        while player.play(lambda: self._stop.requested, self._show) and arguments.loop:
            pass
        player.settle(lambda: self._stop.requested)
        lateness = player.lateness
        self._line.message(
            f"played {count_of(lateness.count, 'message')} up to {self._seconds(player.position):.3f} s of the run; "
            f"late by {lateness.mean / NS_PER_MS:.2f} ms in the mean, {lateness.longest / NS_PER_MS:.1f} ms at most"
        )
        return 0

    def _report_skipped(self) -> int:
        """Print the topics that cannot be played, and return how many can."""
        faults = [topic for topic in self._found.topics.values() if topic.fault]
        skipped = [topic for topic in faults if topic.fault != NOT_CHOSEN]
        for topic in skipped[:_SKIPPED_NAMED]:
            self._line.message(f"skipped {printable(topic.name)}: {printable(topic.fault)}")
        if len(skipped) > _SKIPPED_NAMED:
            self._line.message(f"skipped {len(skipped) - _SKIPPED_NAMED} more topics")
        return len(self._found.topics) - len(faults)

    def _show(self) -> None:
        player = self._player
        if player.paused != self._paused:
            self._paused = player.paused
            self._line.message(
                f"paused: ros2 service call {player.name.rstrip('/')}/resume std_srvs/srv/Trigger goes on"
                if self._paused
                else "goes on"
            )
        for text in player.health.news():
            self._line.message(printable(text))
        passed = self._line.due()
        if not passed:
            return
        count = player.lateness.count - self._shown
        self._shown = player.lateness.count
        self._line.show(
            [
                f"{self._seconds(player.position):8.1f} of {self._seconds(self._found.end):.1f} s",
                f"{count * NS_PER_S / passed:.0f} messages/s",
                f"late {player.lateness.mean / NS_PER_MS:.2f} ms",
            ]
        )

    def _seconds(self, log_time: int) -> float:
        return (log_time - (self._found.run_start or 0)) / NS_PER_S


def _rate(text: str) -> float:
    rate = option_number("--rate", text, 0, MAX_RATE)
    if rate == 0:
        raise UsageError("--rate: 0 would never end")
    return rate


def _target_namespace(spaces: Collection[str], ros: RosArguments) -> str | None:
    """Return the namespace to play into if ROS arguments give one: in it, under the rack's own name (decision)."""
    if not ros.namespace:
        return None
    own = next(iter(spaces)).rpartition("/")[2] if len(spaces) == 1 else ""
    return f"/{ros.placed(own)}"


def _namespace(text: str | None) -> str | None:
    if text is None:
        return None
    if not _SPACE.fullmatch(text) or "__" in text:
        raise UsageError(f"--namespace: {quoted(text)} is not a ROS namespace")
    return "/" + text.strip("/")
