"""What racks that run have in common as sources of the panel, here or elsewhere: they have no past."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import Value
from automax_ros.diagram.placed import diagram_facts
from automax_ros.language.program import Program
from automax_ros.panel.rack_facts import explained, hello_of, operable, uses_of
from automax_ros.panel.source import Asked, Facts, Frame, RequestRefused
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.preview import Present, preview
from automax_ros.rack.operator.rack_log import RackLog
from automax_ros.rackfile.model.rack_names import RackNames

_UNKNOWN = "in a state that is not known"


class PresentRack(ABC):
    """A rack that runs."""

    def __init__(self, names: RackNames, log: RackLog, kind: str, title: str) -> None:
        self._names, self._log, self._kind, self._title = names, log, kind, title

    def hello(self) -> Facts:
        """Return what does not change while the panel is open."""
        return hello_of(self._names, self._kind, title=self._title, operate=operable(self._names.config))

    def unknown(self, names: Sequence[str]) -> list[str]:
        """Return those of the names that mean nothing here."""
        return self._names.unknown(names)

    @abstractmethod
    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        """Return the values for each browser."""

    @abstractmethod
    def status(self, at_ns: int | None) -> Facts:
        """Return how the rack stands."""

    def log(self, after: int) -> list[Facts]:
        """Return errors and operations after entry ``after``, oldest first."""
        return self._log.after(after)

    def answer(self, what: str, fields: Facts) -> Facts:
        """Answer ``diagram`` and ``explain``.

        Raises:
            RequestRefused: there is no such task or code, or it needs a recording.
        """
        if what == "explain":
            return explained(fields["code"])
        if what != "diagram":
            raise RequestRefused("a live rack has no past here", "record it, and open the recording")
        programs, sources = self._versions()
        task = fields["task"].strip().upper()
        if task not in programs or task not in sources:
            raise RequestRefused(f"the rack has no task {quoted(task)}", near_or_listed(task, list(programs)))
        if fields.get("which", "own") != "own":
            raise RequestRefused("a live rack has one version of a task")
        facts: Facts = diagram_facts(programs[task], sources[task], *uses_of(programs))
        return facts

    def describe(self, verb: str, fields: Facts) -> str:
        """Return in one sentence what an operation would do, and what is so now.

        Raises:
            RequestRefused: there is no such name, or not such a value of it.
        """
        status = self.status(None)
        tasks = dict.fromkeys(self._names.programs, _UNKNOWN)
        tasks.update({item["name"]: item["status"] for item in status["tasks"]})
        forced = [item["name"] for item in status["forced"]]
        try:
            return preview(self._names, verb, fields, Present(tasks, forced, status["powered"], self._look))
        except OperationRefused as refused:
            raise RequestRefused(str(refused)) from refused

    def _look(self, name: str) -> Value | None:
        """Return the present value of a name, None if it is not known."""
        return self.frames([Asked((name,))])[0].values[0]

    @abstractmethod
    def _versions(self) -> tuple[Mapping[str, Program], Mapping[str, SourceText]]:
        """Return the tasks as they run now, and their sources."""
