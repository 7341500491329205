"""What a rack keeps between two runs: non-volatile commons and tunables, in a folder that may be damaged."""

import json
import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.rack.loader import load
from automax_ros.rack.rack import Rack
from automax_ros.rack.retention import Restored, Retention, RetentionFault, default_folder

RACK = """\
rack: KEEP
slots:
  0: {module: 57C435, tasks: {T: {priority: 5}}}
common:
  LOST%:
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
100 CALL SCAN_LOOP(TICKS=1)
110 COUNT% = COUNT% + 1
120 LOST% = COUNT%
130 END
"""
VALUES = {"COUNT%": 120, "WIDE!": -70000, "GAIN": 0.1, "ON@": False, "TEXT$": "Grüß\n", "TABLE%(1,2)": -5}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "rack.yaml").write_text(RACK)
    (tmp_path / "T.BLK").write_text(TASK)
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
    assert retention.save(durable=True)
    assert sorted(os.listdir(folder / "state")) == ["state.json"]


def test_restored_values_are_in_the_log_of_writes(folder):
    """A recording must have them, or a replay would begin elsewhere."""
    changed(folder)
    rack, retention = made(folder)
    writes = []

    class Observer:
        def written(self, entries):
            writes.extend(entries)

        def scanned(self, *_):
            pass

        tuned = all_stopped = scanned

    rack.observe(Observer())
    rack.start(retention.restore().settings)
    last = {(write.view, write.element): write.value for write in writes}
    assert last[rack.memory.view("COUNT%"), 0] == 120
    assert {write.time_ns for write in writes} == {0}


def test_edited_task_begins_at_current_again(folder):
    changed(folder)
    (folder / "T.BLK").write_text(TASK.replace("CURRENT=1.5", "CURRENT=3.0"))
    rack, _, restored = begun(folder)
    assert rack.tasks[0].value("K") == 3.0
    assert (restored.commons, restored.tunables) == (6, 0)


def test_common_of_another_shape_begins_as_installed(folder):
    changed(folder)
    text = RACK.replace("TABLE%(1,2)", "TABLE%(2,2)").replace("  WIDE!: {non_volatile: true}\n", "")
    (folder / "rack.yaml").write_text(text.replace("TEXT$:8", "TEXT$:9"))
    rack, _, restored = begun(folder)
    assert rack.memory.present(rack.memory.view("TABLE%")) == [0] * 9
    assert rack.value("TEXT$") == ""
    assert rack.value("GAIN") == pytest.approx(0.1)
    assert restored.commons == 3


def test_rack_without_anything_to_keep_writes_nothing(folder):
    (folder / "rack.yaml").write_text("rack: KEEP\nslots:\n  0: {module: 57C435, tasks: {T: {priority: 5}}}\n"
                                      "common:\n  COUNT%:\n  LOST%:\n")  # fmt: skip
    (folder / "T.BLK").write_text("\n".join(line for line in TASK.splitlines() if "CURRENT" not in line) + "\n")
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
    "another format": b'{"format": 2, "rack": "KEEP", "commons": {}, "tasks": {}}',
    "another rack": b'{"format": 1, "rack": "OTHER", "commons": {}, "tasks": {}}',
    "commons are a list": b'{"format": 1, "rack": "KEEP", "commons": [], "tasks": {}}',
    "tasks are a text": b'{"format": 1, "rack": "KEEP", "commons": {}, "tasks": "x"}',
}


def fault(folder):
    with pytest.raises(RetentionFault) as caught:
        begun(folder)
    assert "state.json" in str(caught.value)
    assert "hint: remove it to start the rack as installed" in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", HOSTILE)
def test_damaged_file_is_a_clear_error(folder, name):
    (folder / "state").mkdir()
    (folder / "state" / "state.json").write_bytes(HOSTILE[name])
    assert "is damaged: " in fault(folder)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"values": [\n    120\n', '"values": [\n    40000\n', "COUNT%"),
        ('"values": [\n    120\n', '"values": [\n    "x"\n', "COUNT%"),
        ('"values": [\n    120\n', '"values": [\n    1, 2\n', "COUNT% has 1 element"),
        ('"values": [\n    120\n', '"values": [\n    NaN\n', "NaN is not a number"),
        ('"values": [\n    120\n', '"values": [\n    1e999\n', "COUNT%"),
        ('"values": [\n    120\n', '"values": 3, "x": [\n 1\n', "not what a rack has written"),
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
    assert words in fault(folder)


def test_what_is_no_file_is_refused_at_once(folder):
    (folder / "state").mkdir()
    os.mkfifo(folder / "state" / "state.json")
    assert "is not a regular file" in fault(folder)
    (folder / "state" / "state.json").unlink()
    (folder / "state" / "state.json").mkdir()
    assert "is a folder" in fault(folder)


def test_folder_that_cannot_be_written_is_told(folder):
    (folder / "state").write_text("a file stands there")
    rack, retention, _ = begun(folder)
    rack.run(0.1)
    with pytest.raises(RetentionFault, match="cannot be written"):
        retention.save()


@settings(deadline=None, derandomize=True, database=None, max_examples=60)
@given(data=st.data())
def test_any_change_of_the_file_is_read_or_refused(tmp_path_factory, data):
    folder: Path = tmp_path_factory.mktemp("rack")
    (folder / "rack.yaml").write_text(RACK)
    (folder / "T.BLK").write_text(TASK)
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
