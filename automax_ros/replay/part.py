"""Replay of one part of a recording, some of its files, as the work of one of many processes."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from weakref import WeakValueDictionary

from automax_ros.core.diagnostics import SourceText
from automax_ros.replay.engine import Replay, ReplayOptions, Run
from automax_ros.replay.scans.carried_state import CarriedState
from automax_ros.replay.scans.totals import Totals

_AT_HAND: WeakValueDictionary[bytes, Replay] = WeakValueDictionary()
"""Replays packed in this process; a fork of the process has them with their tasks compiled."""


@dataclass(frozen=True)
class Part:
    """Files of a recording, from number ``first`` to before ``end``, counted from 0."""

    first: int
    end: int


@dataclass(frozen=True)
class PartResult:
    """The result of a part, up to the first scan after it.

    ``entry`` and ``exit`` are the states carried at its first scan and at the one after it, ``totals`` the counts
    between. ``went_on``: tasks whose first scan is not their start; ``scanned``: those that have scanned.
    ``asked_back``: forces before its first message were needed. ``unsure``: it may not be a continuation of the part
    before, whatever that is. ``ended``: the range of the replay ends in it. ``doubtful``: if this is the end, an
    edited task may have ended differently from the recorded one. ``native`` is ``Replay.native`` of the part.
    """

    entry: CarriedState
    exit: CarriedState
    totals: Totals
    scanned: frozenset[str]
    went_on: frozenset[str]
    asked_back: bool
    unsure: bool
    ended: bool
    doubtful: bool
    native: tuple[str, ...]

    @property
    def clean(self) -> bool:
        """Whether nothing differs, and no note was dropped."""
        return self.totals.clean and not self.totals.full


def packed(replay: Replay) -> bytes:
    """Return a replay in the serialized form for other processes."""
    bag = replay.bag.resolve()
    what = pickle.dumps((bag, dict(replay.new), replay.options, (replay.rack, replay.facts)))
    _AT_HAND[what] = replay
    return what


def replay_part(what: bytes, part: Part) -> PartResult:
    """Execute a part again, independently of the others.

    Raises:
        BagError: it cannot be read, or lacks something that the replay needs.
    """
    replay = _AT_HAND.get(what) or _unpack(what)
    files = len(replay.reader.files)
    base, entry = begun(replay, part.first)
    run = _run(replay, part)
    body = replay.reader.part(part.first, part.end)
    goes_on = run.take_all(body)
    if goes_on and part.end < files:
        goes_on = run.take_up_to_scan(replay.reader.part(part.end, files, body))
    totals = run.totals()
    counted = totals.since(base)
    scanned, went_on = scanning(run, counted)
    return PartResult(
        entry,
        run.carried(),
        counted,
        scanned,
        went_on,
        run.asked_back,
        part.first > 0 and (is_unsure(run) or not base.clean),
        not goes_on,
        bool(run.ends_in_doubt()),
        tuple(replay.native),
    )


def begun(replay: Replay, first: int) -> tuple[Totals, CarriedState]:
    """Return the totals before the first scan of a pass that begins with a file, and the state carried there."""
    run = replay.begin({}, replay.options)
    if first:
        run.take_up_to_scan(replay.reader.part(first, len(replay.reader.files)))
    # Without notes, so that those at the beginning of the first part count as its own.
    return run.totals() if first else run.totals().forgetting_notes(), run.carried()


def scanning(run: Run, counted: Totals) -> tuple[frozenset[str], frozenset[str]]:
    """Return the tasks that have scanned, and those whose first scan was not their start."""
    scanned = {name for name, task in counted.tasks.items() if task.compared or task.left_out}
    scanned |= {name for name, beginning in run.beginnings.items() if beginning.scanned}
    return frozenset(scanned), frozenset(name for name, item in run.beginnings.items() if item.went_on)


def is_unsure(run: Run) -> bool:
    """Return whether a pass that began with a file needed information that only earlier files have."""
    return any(beginning.unsure for beginning in run.beginnings.values())


def _run(replay: Replay, part: Part) -> Run:
    """Return the pass over a part; that of the first part begins with the range."""
    starts: Mapping[str, int] = {}
    if not part.first:
        starts = replay.starts(replay.reader.part(0, part.end), replay.options)
    return replay.begin(starts, replay.options)


@lru_cache(maxsize=1)
def _unpack(what: bytes) -> Replay:
    """Return a replay from its serialized form, compiled once for all of its parts."""
    bag, new, options, stored = pickle.loads(what)
    assert isinstance(bag, Path)
    assert isinstance(options, ReplayOptions)
    sources: dict[str, SourceText] = new
    return Replay(bag, sources, options, stored)
