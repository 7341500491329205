"""A rack elsewhere in the ROS domain as a source of the panel: followed by its messages, operated by its services."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import NameFault
from automax_ros.core.types import Value
from automax_ros.language.program import Program
from automax_ros.messages.types.messages import PlantState, RollState
from automax_ros.panel.present_rack import PresentRack
from automax_ros.panel.rack_facts import operable
from automax_ros.panel.rack_status import Answers, RackStatus, drive_facts, web_facts
from automax_ros.panel.source import Asked, Facts, Frame, RequestRefused
from automax_ros.rack.operator.drive_readings import faults_of
from automax_ros.rackfile.model.rack_names import LocalName, RackNames
from automax_ros.ros.clients.operator_desk import OperatorDesk
from automax_ros.ros.clients.rack_client import NotOperable
from automax_ros.ros.clients.rack_follower import FIND_NS, RackFollower
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments


class JoinedSource(PresentRack):
    """A rack elsewhere, by its namespace with its slash, such as ``/pm1``.

    Commons come by its messages, locals of tasks and the status by its operator; without one, locals are known only
    from states of tasks, which a rack sends seldom.
    """

    def __init__(
        self,
        space: str,
        arguments: RosArguments = NO_ARGUMENTS,
        wait_ns: int = FIND_NS,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Find the rack within ``wait_ns``, and follow it until ``close``.

        Raises:
            UserError: no such rack, several of the name, or one that does not say what it runs from.
            RosUnavailable: ROS cannot be initialised.
        """
        self._follower = follower = RackFollower(space, arguments, wait_ns, should_stop)
        config = follower.stored.config
        super().__init__(
            RackNames(config, follower.stored.programs()), follower.log, "joined", f"{config.name}, {space}"
        )
        self._stored = follower.stored
        self._status = RackStatus(config, [f"operator node of {space}"] if config.operator else [])
        self._desk = OperatorDesk(space, arguments) if config.operator else None

    @property
    def is_over(self) -> bool:
        """Whether the rack has gone."""
        return bool(self._follower.over)

    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        """Return the values for each browser, as they have arrived."""
        meant = {}
        for name in dict.fromkeys(name for item in asked for name in item.names):
            with suppress(NameFault):
                meant[name] = self._names.find(name)
        read: Mapping[str, Value | None] = {}
        if self._desk is not None:
            self._desk.look([item for item in meant.values() if isinstance(item, LocalName)])
            read = self._desk.locals
        with self._follower.run() as run:
            now_ns = run.now_ns
            values = {name: read.get(item.label, run.value(item)) for name, item in meant.items()}
        return [Frame(now_ns, tuple(values.get(name) for name in item.names)) for item in asked]

    def status(self, at_ns: int | None) -> Facts:  # noqa: ARG002
        """Return how the rack stands, as far as its messages and its operator tell."""
        told: Mapping[str, Facts] = {}
        if self._desk is not None:
            self._desk.look()
            told = self._desk.answers
        with self._follower.run() as run:
            own = run.status()
            tasks, forced, drives = run.tasks, list(run.forced()), list(run.drives())
            webs = [web_facts(web.web, web) for web in run.webs()]
            words = {key: word for key in self._status.registers if (word := run.word(*key)) is not None}
        status = {**own, **told.get("status", {}), "time_s": own["time_s"]}
        if told:
            tasks, forced = (
                told["tasks"]["tasks"],
                list(zip(told["forces"]["found"], told["forces"]["values"], strict=False)),
            )
        answers = Answers(
            status,
            words,
            tasks,
            told["errors"]["errors"] if told else (),
            forced,
            [self._drive(state, roll, status["drive_faults"]) for state, roll in drives],
            webs,
        )
        return self._status.facts(answers, self._follower.over)

    def operate(self, verb: str, fields: Facts) -> Facts:
        """Operate the rack by its services; return ``ok``, ``reason`` and what is true afterwards.

        Raises:
            RequestRefused: the rack does not answer.
        """
        if self._desk is None:
            raise RequestRefused(operable(self._names.config)["why"])
        try:
            return self._desk.operate(verb, fields)
        except NotOperable as fault:
            raise RequestRefused(fault.message, fault.hint) from fault

    def close(self) -> None:
        """Leave the graph."""
        if self._desk is not None:
            self._desk.close()
        self._follower.close()

    def _versions(self) -> tuple[Mapping[str, Program], Mapping[str, SourceText]]:
        stored = self._follower.stored
        if stored is not self._stored:  # a task was reloaded
            self._stored = stored
            self._names.programs.update({program.name: program for program in stored.programs()})
        return self._names.programs, stored.sources

    def _look(self, name: str) -> Value | None:
        meant = self._names.find(name)
        if isinstance(meant, LocalName) and self._desk is not None:
            with suppress(NotOperable):
                return self._desk.read([meant])[meant.label]
        return super()._look(name)

    def _drive(self, state: PlantState, roll: RollState | None, trips: Sequence[str]) -> Facts:
        loops = {int(item.cml.facts["io_cntl_slot"]): item.name for item in self._names.programs.values() if item.cml}
        faults = faults_of(trips, loops[state.slot]) if state.slot in loops else ()
        return drive_facts(state.plant, state.slot, state, roll, faults=faults)
