"""One browser of the panel: what it watches, where it stands in a recording, what it was sent, and its requests."""

from __future__ import annotations

import asyncio
import json
import math
import secrets
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any

from websockets.asyncio.server import ServerConnection, broadcast

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError
from automax_ros.panel.commands import OPERATIONS, REQUESTS, Allowance, checked, decoded
from automax_ros.panel.source import Asked, Facts, Frame, RequestRefused, Source

MOST_WAITING = 1 << 16
"""Bytes that may wait for a browser; one with more is skipped (tried: else one that never reads takes 67 MB)."""
PATIENCE_S = 5.0
"""How long a browser may be slow, s; then it is dropped."""
TICKET_S = 30.0
"""How long an operation that was prepared may be confirmed, s (decision)."""
_MOST_ENTRIES = 500
"""Most entries of the log in one message."""
_LOOK_S = 0.02


class Place:
    """Where a browser stands in a recording, at first at its end: at a time, or playing from there at a ``rate``."""

    def __init__(self, from_ns: int, to_ns: int) -> None:
        self._from_ns, self._to_ns, self._at_ns, self._since_s, self.rate = from_ns, to_ns, to_ns, 0.0, 0.0

    def at_ns(self, now_s: float) -> int:
        """Return the time; playing ends with the recording."""
        at_ns = self._at_ns + round((now_s - self._since_s) * self.rate * NS_PER_S)
        if self.rate and at_ns >= self._to_ns:
            self.go(self._to_ns, 0.0, now_s)
        return min(at_ns, self._to_ns)

    def go(self, at_ns: int, rate: float, now_s: float) -> None:
        """Go to a time within the recording, and play from there; whoever plays from the end begins again."""
        at_ns = self._from_ns if rate and at_ns >= self._to_ns else at_ns
        self._at_ns, self._since_s, self.rate = min(max(at_ns, self._from_ns), self._to_ns), now_s, rate


class Session:
    """One browser; ``call`` calls the source.

    Attributes:
        last_entry: the number of the last entry of the log that it was sent.
    """

    def __init__(
        self, connection: ServerConnection, source: Source, call: Callable[..., Awaitable[Any]], hello: Facts
    ) -> None:
        self._connection, self._source, self._call = connection, source, call
        self._operate = hello["operate"]
        self._place = Place(hello["span"]["from_ns"], hello["span"]["to_ns"]) if hello.get("span") else None
        self.last_entry = self._generation = 0
        self._names: tuple[str, ...] = ()
        self._values: list[Value | None] = []
        self._sent: dict[str, object] = {}
        self._status: dict[str, Any] = {}
        self._requests, self._operations = Allowance(50, 100), Allowance(4, 10)
        self._prepared: dict[str, tuple[float, str, Facts]] = {}
        self._slow_since: float | None = None
        self.send({"hello": hello})

    # Requests

    async def serve(self) -> None:
        """Answer requests, one at a time, until the browser has gone; one that asks too much is read more slowly."""
        own = {"watch": self._watch, "seek": self._seek, "play": self._play}
        own |= {"prepare": self._prepare, "confirm": self._confirm}
        async for text in self._connection:
            while self._waiting() > MOST_WAITING or not self._requests.take(_now()):
                await asyncio.sleep(_LOOK_S)
            ident: object = None
            try:
                message = decoded(text)
                ident = message.get("id") if isinstance(message.get("id"), (int, str)) else None
                what = str(message.get("do"))
                given = {key: value for key, value in message.items() if key not in ("id", "do") and value is not None}
                fields = checked(what, given, REQUESTS)
                answer = await (own[what](fields) if what in own else self._call(self._source.answer, what, fields))
                self.send({"id": ident, "ok": answer})
            except UserError as refused:
                self.send({"id": ident, "error": {"message": refused.message, "hint": refused.hint or ""}})

    async def _watch(self, fields: Facts) -> Facts:
        names = tuple(fields["names"])
        unknown = await self._call(self._source.unknown, names)
        self._names, self._values, self._generation = names, [], self._generation + 1
        self._sent.pop("t", None)
        return {"gen": self._generation, "unknown": unknown}

    async def _seek(self, fields: Facts) -> Facts:
        place = self._recorded()
        if "t" not in fields and not {"task", "scan"} <= fields.keys():
            raise RequestRefused("seek: it takes a time t, or a task and the number of its scan")
        found = await self._call(self._source.answer, "seek", fields)
        place.go(found["t"], place.rate, _now())
        return self._show_place()

    async def _play(self, fields: Facts) -> Facts:
        place = self._recorded()
        place.go(place.at_ns(_now()), fields["rate"], _now())
        return self._show_place()

    def _recorded(self) -> Place:
        if self._place is None:
            raise RequestRefused("a rack that runs is shown as it is now", "record it, and open the recording")
        return self._place

    async def _prepare(self, fields: Facts) -> Facts:
        self._expect_operator()
        verb, given = fields["verb"], checked(fields["verb"], fields["fields"], OPERATIONS)
        if not self._operations.take(_now()):
            raise RequestRefused("too many operations at once, nothing was done", "wait a second")
        text, ticket = await self._call(self._source.describe, verb, given), secrets.token_urlsafe(16)
        self._prepared = {key: item for key, item in self._prepared.items() if item[0] > _now()}
        self._prepared[ticket] = _now() + TICKET_S, verb, given
        return {"ticket": ticket, "text": text, "seconds": TICKET_S}

    async def _confirm(self, fields: Facts) -> Any:
        self._expect_operator()
        until_s, verb, given = self._prepared.pop(fields["ticket"], (0.0, "", {}))
        if _now() >= until_s:
            reason = f"this operation was not prepared here in the last {TICKET_S:g} s, or was confirmed already"
            raise RequestRefused(f"{reason}: nothing was done", "prepare it again")
        return await self._call(self._source.operate, verb, given)

    def _expect_operator(self) -> None:
        if not self._operate["allowed"]:
            raise RequestRefused(f"nothing may be operated here: {self._operate['why']}")
        if self._source.is_over:
            raise RequestRefused("the rack does not run any more, nothing was done")

    # What is shown

    def send(self, message: Facts) -> None:
        """Send a message; nobody waits until the browser has it."""
        self._send_plain(_plain(message))

    def _send_plain(self, message: Facts) -> None:
        broadcast([self._connection], json.dumps(message, allow_nan=False, separators=(",", ":")))

    def accepts(self, now_s: float) -> bool:
        """Whether the browser takes what it is sent; one that does not for ``PATIENCE_S`` is dropped."""
        if self._waiting() <= MOST_WAITING:
            self._slow_since = None
            return True
        self._slow_since = self._slow_since or now_s
        if now_s - self._slow_since > PATIENCE_S:
            self._connection.transport.abort()
        return False

    def _waiting(self) -> int:
        return self._connection.transport.get_write_buffer_size()

    def asked(self, now_s: float) -> tuple[int, Asked]:
        """Return the number of the list that is watched, and what it asks."""
        return self._generation, Asked(self._names, None if self._place is None else self._place.at_ns(now_s))

    def is_news(self, kind: str, what: object) -> bool:
        """Whether it was not sent yet; what a live rack says is always news."""
        return self._place is None or self._sent.get(kind) != what

    def show_frame(self, generation: int, asked: Asked, frame: Frame) -> None:
        """Send what has changed since the last frame; another list may be watched by now, which has its own frames."""
        if generation != self._generation:
            return
        before, now = self._values, list(map(_plain_value, frame.values))
        changed = [[place, value] for place, value in enumerate(now) if not before or value != before[place]]
        if changed or self._sent.get("t") != frame.time_ns:
            self._send_plain({"frame": {"gen": generation, "t": frame.time_ns, "v": changed}})
        self._values = now
        self._sent |= {"t": frame.time_ns, "frame": (generation, asked.at_ns)}
        self._show_place()

    def show_status(self, at_ns: int | None, status: Facts) -> None:
        """Send the keys that have changed."""
        now = _plain(status)
        changed = {key: value for key, value in now.items() if key not in self._status or self._status[key] != value}
        self._status |= changed
        self._sent["status"] = at_ns
        if changed:
            self._send_plain({"status": changed})

    def show_log(self, entries: Sequence[Facts]) -> None:
        """Send entries that are new for this browser; the rest of many follows next time."""
        new = [entry for entry in entries if entry["n"] > self.last_entry][:_MOST_ENTRIES]
        if new:
            self.last_entry = new[-1]["n"]
            self.send({"log": new})

    def _show_place(self) -> Facts:
        if self._place is not None:
            at = {"t": self._place.at_ns(_now()), "rate": self._place.rate, "following": False}
            if self._sent.get("at") != at:
                self._sent["at"] = at
                self.send({"at": at})
        return {}


def _plain(value: Any) -> Any:
    """Return a value with texts in place of the numbers that JSON lacks, which are equal to themselves then."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else _plain_value(value)


def _plain_value(value: Any) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _now() -> float:
    return asyncio.get_running_loop().time()
