"""Stimuli of a distributed rack: each process reads the whole file and does what concerns it."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import Observer, config_at, rack_at

from automax_ros.rack.rack import Rack
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack

RACK = """\
rack: PM1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {ONE: {priority: 5}}}
  2: {module: 57C435, tasks: {TWO: {priority: 5}}}
  7: {module: 57C406, plant: REEL}
plants:
  REEL: {motor: dc_150hp_500v}
common:
  A%: {}
"""
TASK = (
    "10 LOCAL N% [CURRENT=1, HIGH=5, LOW=0, STEP=1]\n15 LOCAL M%\n20 CALL SCAN_LOOP(TICKS=1)\n30 M% = M% + 1\n40 END\n"
)
VERBS = """\
- {at: 0.1, set: {A%: 5}}
- {at: 0.1, stop: [ONE, TWO]}
- {at: 0.2, tune: {ONE.N%: 2, TWO.N%: 3}}
- {at: 0.2, force: {A%: 7, ONE.M%: 8, TWO.M%: 9}}
- {at: 0.2, clear_errors: all}
- {at: 0.3, run: TWO}
- {at: 0.3, module: {7: {test_switch: A}}}
- {at: 0.3, plant: {REEL: {short_scr: 3}}}
"""


class Common(Observer):
    """Notes each write with whether it is made in every process."""

    def __init__(self, rack: Rack, stimulation: StimuliPlayer) -> None:
        self.seen: list[tuple[int, int, bool]] = []
        self._rack, self._stimulation = rack, stimulation
        rack.observe(self)

    def written(self, writes):
        entries = (item for group in writes for item in group.entries())
        self.seen += [(item.time_ns, item.value, self._stimulation.is_common) for item in entries]

    def scanned(self, task, record, writes):  # noqa: ARG002
        self.written(writes)


def part(folder: Path, verbs: str, *slots: int) -> tuple[Rack, StimuliPlayer]:
    (folder / "rack.yaml").write_text(RACK)
    for name in ("ONE", "TWO"):
        (folder / f"{name}.BLK").write_text(TASK)
    (folder / "do.yaml").write_text(verbs)
    rack = rack_at(folder / "rack.yaml", local=slots or None)
    file = read_for_rack(folder / "do.yaml", rack)
    assert file.stimuli is not None, file.diagnostics
    return rack, StimuliPlayer(file.stimuli, rack.scheduler)


@pytest.mark.parametrize(
    ("slots", "done"),
    [
        ((0,), ["force A%", "clear_errors "]),
        ((1,), ["stop ONE", "tune ONE.N%", "force A%", "force ONE.M%", "clear_errors "]),
        ((2,), ["stop TWO", "tune TWO.N%", "force A%", "force TWO.M%", "clear_errors ", "run TWO"]),
        ((7,), ["force A%", "clear_errors ", "module 7", "plant REEL"]),
    ],
)
def test_each_process_does_what_concerns_it(tmp_path, slots, done):
    rack, stimulation = part(tmp_path, VERBS, *slots)
    rack.start()
    stimulation.begin()
    rack.run(0.5)
    assert [f"{item.what} {item.of}" for item in stimulation.happened] == done
    assert all(item.ok for item in stimulation.happened)
    assert rack.value("A%") == 7


@pytest.mark.parametrize(
    ("verbs", "said"),
    [
        ("- {at: 0, run: THREE}\n", "the rack has no task 'THREE'"),
        ("- {at: 0, module: {3: {test_switch: A}}}\n", "the rack has no module in slot 3"),
        ("- {at: 0, plant: {DRUM: {short_scr: 3}}}\n", "the rack has no plant 'DRUM'"),
        ("- {at: 0, force: {THREE.M%: 3}}\n", "THREE"),
    ],
)
def test_what_the_rack_does_not_have_is_told_in_every_process(tmp_path, verbs, said):
    with pytest.raises(AssertionError) as told:
        part(tmp_path, verbs, 1)
    assert said in str(told.value)


def test_values_are_written_everywhere_and_operations_are_not(tmp_path):
    verbs = (
        "- {at: 0.001, set: {A%: 5}}\n- {at: 0.002, ramp: {A%: {to: 8, over: 0.003}}}\n"
        "- {at: 0.007, stop_all: true}\n- {at: 0.010, force: {A%: 1}}\n"
    )
    rack, stimulation = part(tmp_path, verbs)
    rack.start()
    common = Common(rack, stimulation)
    stimulation.begin()
    rack.run(0.02)
    values = [(at // 1_000_000, value, everywhere) for at, value, everywhere in common.seen]
    assert values[:4] == [(1, 5, True), (3, 6, True), (4, 7, True), (5, 8, True)]
    assert (10, 1, True) in values
    assert [item for item in values if item[0] == 7] == [(7, 0, False)], "STOP ALL clears memory"


def test_who_joins_leaves_out_what_has_happened(tmp_path):
    rack, stimulation = part(
        tmp_path, "- {at: 0.1, set: {A%: 5}}\n- {at: 0.2, set: {A%: 6}}\n- {at: 0.3, set: {A%: 7}}\n"
    )
    rack.start()
    rack.run(0.2)
    common = Common(rack, stimulation)
    stimulation.begin(joining=True)
    rack.run(0.2)
    assert [value for _, value, _ in common.seen] == [7]


def test_a_file_may_be_json(tmp_path):
    """Keys of JSON stand in quotes, slots too."""
    (tmp_path / "rack.yaml").write_text("rack: PM1\nslots:\n  0: {module: 57C435}\n  7: {module: 57C406}\n")
    config = config_at(tmp_path / "rack.yaml")
    path = tmp_path / "stimuli.json"
    path.write_text('[{"at": 1.5, "module": {"7": {"test_switch": "A", "fault_reset_switch": true}}}]\n')
    read = read_for_rack(path, Rack(config))
    assert read.stimuli is not None, read.diagnostics
    assert [action.of for action in read.stimuli[0].actions] == ["7", "7"]
