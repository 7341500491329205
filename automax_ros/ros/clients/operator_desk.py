"""Asks the operator of a rack elsewhere again and again how it stands, in a thread, and operates it."""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Mapping
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import value_of
from automax_ros.rackfile.model.rack_names import LocalName
from automax_ros.ros.clients.rack_client import RackClient
from automax_ros.ros.setup.arguments import RosArguments

STATUS_S, LOCALS_S = 0.5, 0.2
"""Times between two requests for the status of a rack, and for locals of its tasks, s (decision)."""
ANSWER_NS = 5 * NS_PER_S
"""How long a rack has to answer, as for `automax ctl`."""
_READS = ("status", "tasks", "errors", "forces")
_INTEREST_S = 5.0
"""The rack is left alone when nobody has looked for this long, s (decision)."""


class OperatorDesk:
    """The desk of one rack, with its namespace with its slash.

    ``answers`` are the last answers to status, tasks, errors and forces, ``locals`` the last values of locals by their
    full names; both are empty while the rack is not asked or does not
    answer.

    Raises:
        RosUnavailable: ROS cannot be initialised.
        NotOperable: all methods but ``look``, if the rack does not answer or there are several of its name.
    """

    def __init__(self, space: str, arguments: RosArguments) -> None:
        self.answers: dict[str, dict[str, Any]] = {}
        self.locals: dict[str, Value | None] = {}
        self._wanted: Collection[LocalName] = ()
        self._looked_s = 0.0
        self._closing = threading.Event()
        self._turn = threading.Lock()
        self._client = RackClient(space, arguments, self._closing.is_set)
        self._thread = threading.Thread(target=self._poll, name=f"operator of {space}", daemon=True)
        self._thread.start()

    def look(self, wanted: Collection[LocalName] | None = None) -> None:
        """Ask the rack for some more seconds, and from now on for these locals."""
        self._looked_s = time.monotonic()
        self._wanted = self._wanted if wanted is None else wanted

    def operate(self, verb: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Have the rack do something; return the fields of its answer, ``ok`` and ``reason`` of each."""
        with self._turn:
            self._client.find(ANSWER_NS)
            answer = self._client.ask(verb, fields, ANSWER_NS)
        if "success" in answer:  # a Trigger's answer has other names
            answer |= {"ok": answer["success"], "reason": "" if answer["success"] else answer["message"]}
        return answer

    def read(self, wanted: Collection[LocalName]) -> dict[str, Value | None]:
        """Return the present values of locals by their full names."""
        names = list(dict.fromkeys(f"{item.task}.{item.element.name}" for item in wanted))
        if not names:
            return {}
        answer = self._ask("get", {"names": names})
        texts = dict(zip(answer["found"], answer["values"], strict=False))
        return {item.label: _value(texts.get(f"{item.task}.{item.element.name}", ""), item) for item in wanted}

    def close(self) -> None:
        """Stop asking, and leave the graph."""
        self._closing.set()
        self._thread.join()
        self._client.__exit__()

    def _ask(self, verb: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        with self._turn:
            return self._client.ask(verb, fields, ANSWER_NS)

    def _poll(self) -> None:
        due_s = 0.0
        while not self._closing.wait(LOCALS_S):
            now_s = time.monotonic()
            if now_s - self._looked_s > _INTEREST_S:
                self.answers, self.locals = {}, {}
                continue
            try:
                self.locals = self.read(self._wanted)
                if now_s >= due_s:
                    due_s = now_s + STATUS_S
                    self.answers = {verb: self._ask(verb, {}) for verb in _READS}
            except Exception:  # it has gone or is being closed; whoever operates it is told
                self.answers, self.locals = {}, {}


def _value(text: str, meant: LocalName) -> Value | None:
    """Return the value in the text of a reading; None if it is not one, as for elements of arrays of strings."""
    symbol = meant.element.variable
    if symbol.type is DataType.STRING:
        return text[1:-1] if text and not symbol.dimensions else None
    parts = text.split(", ")
    return value_of(parts[meant.element.index], symbol.type) if meant.element.index < len(parts) else None
