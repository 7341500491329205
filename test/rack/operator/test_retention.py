"""What a rack keeps between two runs: commons, forces and tasks, in a folder that may be damaged."""

import json
import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.retention import Restored, Retention, RetentionFault, default_folder
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from rack.helpers import Observer, written_in

RACK = """\
rack: KEEP
slots:
  0: {module: 57C435, tasks: {T: {priority: 5}}}
common:
  LOST%:
  PLAIN%:
  FORCINGSTATUS@:
  COUNT%: {non_volatile: true, preset: 7}
  WIDE!: {non_volatile: true}
  GAIN: {non_volatile: true, preset: 0.5}
  ON@: {non_volatile: true, preset: true}
  TEXT$:8: {non_volatile: true}
  TABLE%(1,2): {non_volatile: true}
"""
TASK = """\
10 COMMON LOST%, COUNT%
20 LOCAL K [CURRENT=1.5, LOW=0.0, HIGH=10.0]
30 LOCAL N% [CURRENT=4, LOW=0, HIGH=10]
40 LOCAL OWN%, NIL%, LIST(2), NOTE$:8
50 NOTE$ = "Grüß"
60 LIST(1) = 0.1
100 CALL SCAN_LOOP(TICKS=1)
110 COUNT% = COUNT% + 1
120 LOST% = COUNT%
125 IF OWN% = 3 THEN NIL% = 1 / NIL%
126 OWN% = OWN% + 1
130 END
"""
VALUES = {"COUNT%": 120, "WIDE!": -70000, "GAIN": 0.1, "ON@": False, "TEXT$": "Grüß\n", "TABLE%(1,2)": -5}


@pytest.fixture
def folder(tmp_path):
    written_in(tmp_path, RACK, T=TASK)
    return tmp_path


def made(folder):
    rack = Rack(load(folder / "rack.yaml").config)
    return rack, Retention(rack, folder / "state")


def begun(folder):
    """A rack that has started from what was kept."""
    rack, retention = made(folder)
    restored = retention.restore()
    rack.start(restored.settings)
    return rack, retention, restored


def changed(folder):
    """A rack that has run, been written to and tuned, and was saved."""
    rack, retention, _ = begun(folder)
    rack.run(0.1)
    for name, value in VALUES.items():
        view = rack.memory.view(name.partition("(")[0])
        rack.write_view(view, [(5 if "(" in name else 0, value)], 3)
    rack.tune(rack.tasks[0], "K", 2.25)
    assert retention.save()
    return rack, retention


def kept_of(rack):
    variables = enumerate(rack.config.variables)
    commons = {item.name: rack.memory.present(view) for view, item in variables if item.non_volatile}
    return commons, [rack.tasks[0].value(name) for name in ("K", "N%")]


def test_nothing_kept_is_an_installation(folder):
    rack, _, restored = begun(folder)
    assert restored == Restored()
    assert rack.value("COUNT%") == 7
    assert not (folder / "state").exists()


def test_values_survive(folder):
    before, _ = changed(folder)
    after, _, restored = begun(folder)
    assert kept_of(after) == kept_of(before)
    assert after.value("LOST%") == 0, "a volatile common is lost (2.4.5)"
    assert (restored.commons, restored.tunables) == (6, 1)


def test_saved_only_when_changed(folder):
    _, retention = changed(folder)
    stamp = (folder / "state" / "state.json").stat().st_ino
    assert not retention.save()
    assert (folder / "state" / "state.json").stat().st_ino == stamp
    after, retention, _ = begun(folder)
    after.run(0.02)
    assert retention.save()
    assert sorted(os.listdir(folder / "state")) == ["state.json"]


def test_restored_values_are_in_the_log_of_writes(folder):
    """A recording must have them, or a replay would begin elsewhere."""
    changed(folder)
    rack, retention = made(folder)
    writes = []

    class Notes(Observer):
        def written(self, entries):
            writes.extend(entry for group in entries for entry in group.entries())

    rack.observe(Notes())
    rack.start(retention.restore().settings)
    last = {(write.view, write.element): write.value for write in writes}
    assert last[rack.memory.view("COUNT%"), 0] == 120
    assert {write.time_ns for write in writes} == {0}


def test_edited_task_begins_at_current_again(folder):
    changed(folder)
    (folder / "T.BLK").write_text(TASK.replace("CURRENT=1.5", "CURRENT=3.0"))
    rack, _, restored = begun(folder)
    assert (rack.tasks[0].value("K"), rack.tasks[0].value("OWN%")) == (3.0, 0)
    assert (restored.commons, restored.tunables) == (6, 0)
    assert restored.notes == ("task T was edited: it begins as installed",)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("TABLE%(1,2)", "TABLE%(2,2)", "TABLE% was kept as INTEGER (1,2); {}:13 defines INTEGER (2,2)"),
        ("TABLE%(1,2)", "TABLE%(5)", "TABLE% was kept as INTEGER (1,2); {}:13 defines INTEGER (5)"),
        ("TABLE%(1,2)", "TABLE%", "TABLE% was kept as INTEGER (1,2); {}:13 defines INTEGER"),
        ("TEXT$:8", "TEXT$:9", "TEXT$ was kept as STRING of 8 characters; {}:12 defines STRING of 9 characters"),
        ("PLAIN%:", "PLAIN%(3):", "PLAIN% was kept as forced ({}:6): PLAIN% cannot be forced: it is an array"),
    ],
)
def test_a_common_of_another_shape_is_an_error_that_shows_both_places(folder, old, new, words):
    rack, retention = changed(folder)
    rack.force("PLAIN%", 4)
    retention.save()
    text = RACK.replace(old, new)
    assert text != RACK
    (folder / "rack.yaml").write_text(text)
    with pytest.raises(RetentionFault) as caught:
        begun(folder)
    assert caught.value.code == "AMX6713"
    assert words.format(folder / "rack.yaml") in caught.value.message
    assert caught.value.place == str(folder / "state" / "state.json")
    (folder / "rack.yaml").write_text(RACK)
    assert begun(folder)[2].commons == 6, "nothing was lost"


def test_what_is_not_there_any_more_is_told(folder):
    rack, retention = changed(folder)
    rack.force("PLAIN%", 4)
    retention.save()
    text = RACK.replace("  WIDE!: {non_volatile: true}\n", "").replace("GAIN: {non_volatile: true, ", "GAIN: {")
    (folder / "rack.yaml").write_text(text.replace("  PLAIN%:\n", ""))
    rack, _, restored = begun(folder)
    assert set(restored.notes) == {
        "WIDE! was kept and is not non_volatile any more: its value is lost",
        "GAIN was kept and is not non_volatile any more: its value is lost",
        "PLAIN% was forced and is not defined any more",
    }
    assert (rack.value("GAIN"), restored.commons, rack.forces()) == (0.5, 4, [])


def test_locals_error_logs_and_forces_survive(folder):
    rack, retention = changed(folder)
    rack.force("PLAIN%", 44)
    rack.force("COUNT%", -7)
    rack.run(0.05)
    retention.save()
    task = rack.tasks[0]
    own, log = task.value("OWN%"), task.errors.flatten()
    assert (own > 20, log[:3]) == (True, [2, 125, 7024])
    after, _, restored = begun(folder)
    task = after.tasks[0]
    assert (task.value("OWN%"), task.value("LIST")[1], task.value("NOTE$")) == (own, pytest.approx(0.1), "Grüß")
    assert task.errors.flatten() == log
    assert [(item.name, item.value) for item in after.forces()] == [("PLAIN%", 44), ("COUNT%", -7)]
    assert (after.value("FORCINGSTATUS@"), restored.forces) == (True, 2)
    after.run(0.05)
    assert (after.value("COUNT%"), task.value("OWN%")) == (-7, own + 10)


AUTO = RACK.replace("rack: KEEP\n", "rack: KEEP\nauto_run: true\n").replace(
    "T: {priority: 5}", "T: {priority: 5}, U: {priority: 6, file: T.BLK}, V: {priority: 7, file: V.BLK}"
)
FAULTY = "10 LOCAL I%\n20 CALL SCAN_LOOP(TICKS=9)\n30 FOR I% = 0 TO 1\n40 I% = 0\n50 NEXT I%\n60 END\n"


def statuses(rack):
    return [task.status.name for task in rack.tasks]


@pytest.mark.parametrize("auto_run", [True, False])
def test_with_auto_run_those_tasks_run_that_ran(folder, auto_run):
    (folder / "V.BLK").write_text("10 CALL SCAN_LOOP(TICKS=1)\n20 END\n")
    (folder / "rack.yaml").write_text(AUTO if auto_run else AUTO.replace("auto_run: true", "auto_run: false"))
    rack, retention, _ = begun(folder)
    assert statuses(rack) == ["RUNNING"] * 3
    rack.operations.stop("U")
    retention.save()
    after, retention, _ = begun(folder)
    assert statuses(after) == (["RUNNING", "STOPPED", "RUNNING"] if auto_run else ["RUNNING"] * 3)
    after.run(0.02)
    ran = statuses(after)
    after.operations.power(1_000_000_000)
    retention.save()
    again, _, _ = begun(folder)
    assert statuses(again) == ran, "what ran when the power went"


def test_auto_run_starts_nothing_after_a_fault(folder):
    written_in(folder, AUTO, V=FAULTY)
    rack, retention, _ = begun(folder)
    rack.run(0.06)
    assert statuses(rack) == ["STOPPED", "STOPPED", "FAULTED"]
    retention.save()
    after, _, _ = begun(folder)
    assert statuses(after) == ["STOPPED", "STOPPED", "FAULTED"]
    with pytest.raises(OperationRefused, match="clear the error log first"):
        after.operations.run("V")
    after.operations.clear_errors("V")
    after.operations.run("V")


def test_rack_without_anything_to_keep_writes_nothing(folder):
    (folder / "rack.yaml").write_text("rack: KEEP\nslots:\n  0: {module: 57C435, tasks: {T: {priority: 5}}}\n"
                                      "common:\n  COUNT%:\n  LOST%:\n")  # fmt: skip
    (folder / "T.BLK").write_text("10 COMMON COUNT%\n20 CALL SCAN_LOOP(TICKS=1)\n30 COUNT% = COUNT% + 1\n40 END\n")
    rack, retention, _ = begun(folder)
    rack.run(0.1)
    assert not retention.save()
    assert not (folder / "state").exists()


def test_default_folder_is_next_to_the_rack_file(folder):
    assert default_folder(load(folder / "rack.yaml").config) == folder / ".automax" / "KEEP"


HOSTILE = {
    "empty": b"",
    "not JSON": b"{",
    "not UTF-8": b"\xff\xfe",
    "a list": b"[]",
    "a number": b"5",
    "deep": b"[" * 100_000,
    "digits": b"1" * 100_000,
    "nothing in it": b"{}",
    "another format": b'{"format": 3, "rack": "KEEP", "commons": {}, "forced": {}, "registers": {}, "tasks": {}}',
    "another rack": b'{"format": 2, "forced": {}, "rack": "OTHER", "commons": {}, "tasks": {}}',
    "commons are a list": b'{"format": 2, "forced": {}, "rack": "KEEP", "commons": [], "tasks": {}}',
    "tasks are a text": b'{"format": 2, "forced": {}, "rack": "KEEP", "commons": {}, "tasks": "x"}',
}


def fault(folder, code):
    with pytest.raises(RetentionFault) as caught:
        begun(folder)
    assert caught.value.code == code
    assert "state.json" in str(caught.value)
    assert "hint: remove it to start the rack as installed" in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", HOSTILE)
def test_damaged_file_is_a_clear_error(folder, name):
    (folder / "state").mkdir()
    (folder / "state" / "state.json").write_bytes(HOSTILE[name])
    assert "is damaged: " in fault(folder, "AMX6711")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"values": [120', '"values": [40000', "COUNT%"),
        ('"values": [120', '"values": ["x"', "COUNT%"),
        ('"values": [120', '"values": [1, 2', "COUNT% has 1 element"),
        ('"values": [120', '"values": [NaN', "NaN is not a number"),
        ('"values": [120', '"values": [1e999', "COUNT%"),
        ('"values": [120', '"values": 3, "x": [1', "not what a rack has written"),
        ('"K": 2.25', '"K": 99.0', "K = 99 lies outside"),
        ('"K": 2.25', '"K": "2"', "K cannot be"),
        ('"K": 2.25', '"L": 2.25', "it lacks 'K'"),
    ],
)
def test_value_that_does_not_fit_is_a_clear_error(folder, old, new, words):
    changed(folder)
    path = folder / "state" / "state.json"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert words in fault(folder, "AMX6711")


def test_what_is_no_file_is_refused_at_once(folder):
    (folder / "state").mkdir()
    os.mkfifo(folder / "state" / "state.json")
    assert "is not a regular file" in fault(folder, "AMX6710")
    (folder / "state" / "state.json").unlink()
    (folder / "state" / "state.json").mkdir()
    assert "is a folder" in fault(folder, "AMX6710")


def test_folder_that_cannot_be_written_is_told(folder):
    (folder / "state").write_text("a file stands there")
    rack, retention, _ = begun(folder)
    rack.run(0.1)
    with pytest.raises(RetentionFault, match="cannot be written") as caught:
        retention.save()
    assert caught.value.code == "AMX6712"


@settings(deadline=None, derandomize=True, database=None, max_examples=60)
@given(data=st.data())
def test_any_change_of_the_file_is_read_or_refused(tmp_path_factory, data):
    folder: Path = tmp_path_factory.mktemp("rack")
    written_in(folder, RACK, T=TASK)
    changed(folder)
    path = folder / "state" / "state.json"
    text = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(text)
    rack, retention = made(folder)
    try:
        restored = retention.restore()
    except RetentionFault:
        return
    rack.start(restored.settings)
    retention.save()
    json.loads(path.read_bytes())


PARTS = RACK.replace(
    "  0: {module: 57C435, tasks: {T: {priority: 5}}}\n",
    """\
  0: {module: 57C413}
  1: {module: 57C435, tasks: {T: {priority: 5}}}
  2: {module: 57C435, tasks: {U: {priority: 5}}}
""",
)


def test_each_process_of_a_rack_keeps_what_is_its_own(folder):
    written_in(folder, PARTS, U="10 LOCAL OWN%\n100 CALL SCAN_LOOP(TICKS=1)\n110 OWN% = OWN% + 1\n120 END\n")
    kept = {}
    for slot in (0, 1, 2):
        rack = Rack(load(folder / "rack.yaml").config, local={slot})
        retention = Retention(rack, folder / f"state_{slot}")
        rack.start()
        rack.run(0.1)
        rack.force("LOST%", 5)
        if slot == 2:
            rack.force("U.OWN%", 6)
        kept[slot] = retention.present()
    assert [sorted(item["tasks"]) for item in kept.values()] == [[], ["T"], ["U"]]
    assert [item["forced"] for item in kept.values()] == [{"LOST%": 5}, {}, {"U.OWN%": 6}]
    assert [bool(item["commons"]) for item in kept.values()] == [True, False, False]
    assert "COUNT%" in kept[0]["commons"]
