"""A small source, a server of it, and browsers of bytes: what the tests of the panel's server share."""

import http.client
import json
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from websockets.sync.client import ClientConnection, connect

from automax_ros.panel.security import PanelOptions
from automax_ros.panel.server import PanelServer
from automax_ros.panel.source import Asked, Facts, Frame, RequestRefused, Source


class SmallSource:
    """A rack of three values, or a recording if it has a ``span``; what tests change are its attributes."""

    is_over = False

    def __init__(self, *, operator: bool = True, span: tuple[int, int] | None = None) -> None:
        self.operator, self.span = operator, span
        self.time_ns = 0
        self.values: dict[str, Any] = {"REF%": 0, "RUN@": False, "SPEED": 1.5}
        self.entries: list[Facts] = []
        self.operated: list[tuple[str, Facts]] = []
        self.asked_at: list[int | None] = []
        self.bug: Exception | None = None
        self.closed = 0

    def hello(self) -> Facts:
        span = None if self.span is None else {"from_ns": self.span[0], "to_ns": self.span[1]}
        why = "" if self.operator else "its rack file does not say operator: true"
        return {"rack": "PM1", "span": span, "operate": {"allowed": self.operator, "why": why}}

    def unknown(self, names: Sequence[str]) -> list[str]:
        return [name for name in names if name not in self.values]

    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        if self.bug is not None:
            raise self.bug
        self.asked_at += [item.at_ns for item in asked]
        return [
            Frame(self.time_ns if item.at_ns is None else item.at_ns, tuple(map(self.values.get, item.names)))
            for item in asked
        ]

    def status(self, at_ns: int | None) -> Facts:
        return {"over": "", "powered": True, "time_ns": self.time_ns if at_ns is None else at_ns}

    def log(self, after: int) -> list[Facts]:
        return [entry for entry in self.entries if entry["n"] > after]

    def answer(self, what: str, fields: Facts) -> Facts:
        if what == "explain":
            raise ValueError(fields["code"])
        if what == "diagram":
            raise RequestRefused("no such task", "there is SPEED")
        return {"t": fields["t"]} if what == "seek" else {"large": "x" * 1_000_000}

    def describe(self, verb: str, fields: Facts) -> str:
        return f"{verb} {dict(fields)}"

    def operate(self, verb: str, fields: Facts) -> Facts:
        self.operated.append((verb, fields))
        return {"ok": True, "reason": ""}

    def close(self) -> None:
        self.closed += 1


@contextmanager
def served(source: Source, **options: Any) -> Iterator[PanelServer]:
    server = PanelServer(source, PanelOptions(**{"port": 0, **options}))
    server.start()
    try:
        yield server
    finally:
        server.close()


class Answer(NamedTuple):
    status: int
    headers: http.client.HTTPMessage
    body: str


def host_of(server: PanelServer) -> str:
    """Name and port of a server."""
    return server.address.removeprefix("http://").partition("/")[0]


def ask(server: PanelServer, path: str, *, method: str = "GET", **headers: str) -> Answer:
    """Ask over HTTP, redirections as they are; ``Host`` is right unless it is given."""
    connection = http.client.HTTPConnection("127.0.0.1", int(host_of(server).rpartition(":")[2]), timeout=20)
    connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    with connection.getresponse() as response:
        return Answer(response.status, response.headers, response.read().decode(errors="replace"))


def cookie_of(server: PanelServer) -> str:
    """Enter by the printed address and return the cookie that it is exchanged for."""
    answer = ask(server, "/" + server.address.partition("/?")[2].join(["?", ""]))
    assert answer.status == 303
    return str(answer.headers["Set-Cookie"]).partition(";")[0]


class Browser:
    """A socket as a page opens it."""

    def __init__(self, server: PanelServer, cookie: str | None = None, origin: str | None = None) -> None:
        host = host_of(server)
        headers = {"Cookie": cookie_of(server) if cookie is None else cookie}
        opening = connect(
            f"ws://{host}/socket",
            origin=f"http://{host}" if origin is None else origin,  # type: ignore[arg-type]
            additional_headers=headers,
            max_size=1 << 24,
            open_timeout=20,
        )
        self.socket: ClientConnection = opening.__enter__()
        self._last = 0
        self.shown: list[Facts] = []

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def next(self, key: str, timeout: float = 20.0) -> Any:
        """The next message of a kind; those of other kinds are kept in ``shown``."""
        end = time.monotonic() + timeout
        while True:
            message = json.loads(self.socket.recv(timeout=end - time.monotonic()))
            if key in message:
                return message if key == "id" else message[key]
            self.shown.append(message)

    def send(self, text: str | bytes) -> Facts:
        """Send a text and return the answer."""
        self.socket.send(text)
        return self.next("id")

    def ask(self, what: str, **fields: Any) -> Facts:
        """Ask and return what is answered: ``ok``, or ``error``."""
        self._last += 1
        answer = self.send(json.dumps({"id": self._last, "do": what, **fields}))
        assert answer.pop("id") == self._last
        return answer
