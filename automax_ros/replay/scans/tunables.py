"""Tunables in a replay: values set by the operator are set again; until then an edited CURRENT holds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from automax_ros.compile.base.layout import Layout
from automax_ros.core.types import DataType, Value, type_of_name
from automax_ros.core.values import source_text
from automax_ros.messages.types.messages import TaskState
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.scans.state import current_values, places_of, tunable_names
from automax_ros.replay.scans.stored_rack import ReplaySource
from automax_ros.runtime.tasks.task import Task


class Tunables:
    """The tunables of one task, from its recorded states; ``layout`` is the recorded one.

    ``note`` is called with notes for the user, ``when`` converts a stamp to the text of a time.
    """

    def __init__(
        self,
        bag: Path,
        source: ReplaySource,
        layout: Layout,
        note: Callable[[str], None],
        when: Callable[[int], str],
    ) -> None:
        self._bag, self._task_name, self._note, self._when = bag, source.name, note, when
        self._names = tunable_names(layout)
        self._places: tuple[str, dict[str, int]] | None = None
        self._current = current_values(source.recorded.program if source.recorded else None)
        self._known: dict[str, Value] = dict(self._current)
        new = current_values(source.compiled.program)
        self._changed = {name: new[name] for name, value in self._current.items() if new.get(name, value) != value}
        for name, value in self._changed.items():
            old = source_text(self._current[name])
            note(f"tunable {name} starts at its new CURRENT={source_text(value)}, not at {old}")

    @property
    def known(self) -> list[tuple[str, float]]:
        """The last recorded values by name, all as float, as in states."""
        return sorted((name, float(value)) for name, value in self._known.items())

    def fresh(self, state: TaskState) -> dict[str, Value]:
        """Return the tunables that an edited task does not restore from a state: those whose CURRENT was edited.

        One that the operator had set by then is restored nevertheless.

        Raises:
            BagError: the state does not fit the task.
        """
        recorded = self._recorded_values(state)
        fresh: dict[str, Value] = {}
        for name, value in self._changed.items():
            if recorded.get(name, self._current[name]) == self._current[name]:
                fresh[name] = value
            else:
                when = self._when(state.stamp)
                self._note(f"tunable {name} had been set to {recorded[name]:.8g} before {when} s: that counts")
        return fresh

    def know(self, state: TaskState) -> None:
        """Remember the values of a state that the task has restored.

        Raises:
            BagError: the state does not fit the task.
        """
        self._known.update(self._recorded_values(state))

    def set_again(self, task: Task, state: TaskState) -> None:
        """Set the tunables that the operator has set since the previous state.

        Raises:
            BagError: the state does not fit the task.
        """
        for name, value in self._recorded_values(state).items():
            if self._known.get(name) == value:
                continue
            self._known[name] = value
            text = source_text(value) if type_of_name(name) is DataType.REAL else f"{value:.10g}"
            what = f"tunable {name} set to {text} at {self._when(state.stamp)} s"
            try:
                task.tune(name, value)
            except KeyError:
                self._note(f"{what}: the new source has no such tunable")
            except ValueError as error:
                self._note(f"{what}: not here, {error}")
            else:
                self._note(what)

    def _recorded_values(self, state: TaskState) -> dict[str, float]:
        """Return the tunables in a state; their places are looked up once per layout."""
        if self._places is None or self._places[0] != state.layout_hash:
            self._places = (state.layout_hash, places_of(self._bag, state, self._names))
        try:
            return {name: state.value[place] for name, place in self._places[1].items()}
        except IndexError as error:
            raise BagError("AMX6813", self._bag, f"a state of task {self._task_name} is too short") from error
