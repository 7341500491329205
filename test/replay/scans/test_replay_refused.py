"""What replay refuses, and how: recordings without sources, hostile attachments and messages, wrong tasks."""

from __future__ import annotations

import contextlib
import math
import tracemalloc
from pathlib import Path

import pytest
from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st
from recordings.live_racks import build

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.messages import CommonImage, CommonWrite, Scan, TaskState, Values, VariableTable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.scans.stored_rack import SourceRefused
from replay.replays import SPEED, WORK, edited, record, recorded, replayed, rewritten


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=0.5)


def refusal(bag: Path, new=None, **options) -> BagError:
    with pytest.raises(BagError) as error:
        replayed(bag, new, **options)
    assert "\n" not in error.value.message
    return error.value


def without(*names: str):
    return lambda name, data: None if name in names else data


def with_data(name: str, data: bytes):
    return lambda own, before: data if own == name else before


def test_no_recording(tmp_path):
    assert refusal(tmp_path / "none").code == "AMX6810"
    assert refusal(tmp_path).code == "AMX6810"


def test_recording_without_a_rack_file(bag, tmp_path):
    error = refusal(rewritten(bag, tmp_path / "bag", attachments=without("rack.yaml")))
    assert error.code == "AMX6830"
    assert "for `ros2 bag record` name the topic /<rack>/config too" in error.hint


def test_recording_without_a_source(bag, tmp_path):
    other = rewritten(bag, tmp_path / "bag", attachments=without("WORK.BLK"))
    error = refusal(other)
    assert (error.code, error.hint) == (
        "AMX6830",
        "give it with --task WORK=FILE, or leave the task out with --only",
    )
    assert replayed(other, only=("SPEED",)).identical
    report = replayed(other, {"WORK": WORK})
    assert report.identical
    assert report.tasks[1].edited, "nothing tells that it is the same"


def test_task_that_is_not_in_the_recording(bag):
    error = refusal(bag, {"SPED": SPEED})
    assert (error.code, error.hint) == ("AMX6827", "did you mean SPEED?")
    assert refusal(bag, only=("MOTOR",)).code == "AMX6827"


def test_range_without_scans(bag):
    assert refusal(bag, from_ns=3 * NS_PER_S).code == "AMX6825"


def test_source_with_errors_is_refused_with_its_diagnostics(bag):
    with pytest.raises(SourceRefused) as error:
        replayed(bag, {"WORK": edited(WORK, ("COPY$ =", "COPY% ="))})
    ((source, diagnostics),) = error.value.findings
    assert source.name == "new/WORK.BLK"
    assert [(item.code, item.span.line) for item in diagnostics if item.severity.value == "error"] == [("AMX4001", 6)]


def test_common_that_the_rack_does_not_have_is_named_with_its_line(bag):
    with pytest.raises(SourceRefused) as error:
        replayed(bag, {"WORK": edited(WORK, ("10 COMMON GAIN", "10 COMMON SLIP%, GAIN"))})
    ((_, diagnostics),) = error.value.findings
    (found,) = [item for item in diagnostics if item.code == "AMX4010"]
    assert "SLIP%" in found.message
    assert found.span.line == 1


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"\0\xff\xfe",
        b"rack: [",
        b"rack: &a LINE1\nslots: *a\n",
        b"{" * 5000,
        b"rack: LINE1\nslots:\n  1: {module: 57C435, tick_ms: 5.5, tasks: {NONE: {priority: 4}}}\n",
        b"!!python/object/apply:os.system ['touch /tmp/owned']",
    ],
)
def test_hostile_rack_file(bag, tmp_path, text):
    other = rewritten(bag, tmp_path / "bag", attachments=with_data("rack.yaml", text))
    with pytest.raises((BagError, SourceRefused)):
        replayed(other)


def test_rack_file_inside_names_no_file_outside(bag, tmp_path):
    """Whatever ``file:`` says: the source is the attachment, no path is opened."""
    secret = tmp_path / "SECRET.BLK"
    secret.write_text("not a task")
    yaml = (bag.parent / "rack.yaml").read_text().replace("{priority: 8}", f"{{priority: 8, file: {secret}}}")
    assert str(secret) in yaml
    other = rewritten(bag, tmp_path / "bag", attachments=with_data("rack.yaml", yaml.encode()))
    assert replayed(other).identical


def test_too_large_source_inside(bag, tmp_path):
    other = rewritten(bag, tmp_path / "bag", attachments=with_data("WORK.BLK", b"! \n" * 400_000))
    assert refusal(other).code == "AMX6814"


def test_exchanged_source_inside_is_noticed(bag, tmp_path):
    """An attachment that is not what ran would make every difference meaningless."""
    text = edited(WORK, ("COUNT! + 1", "COUNT! + 2")).encode()
    other = rewritten(bag, tmp_path / "bag", attachments=with_data("WORK.BLK", text))
    error = refusal(other)
    assert (error.code, error.message) == (
        "AMX6831",
        "task WORK ran with another source than the WORK.BLK stored inside",
    )


def test_table_of_another_rack(bag, tmp_path):
    def change(message):
        return message._replace(variables=message.variables[1:]) if isinstance(message, VariableTable) else message

    assert refusal(rewritten(bag, tmp_path / "bag", change)).code == "AMX6831"


def test_scans_of_an_unknown_task(bag, tmp_path):
    def change(message):
        return message._replace(task="\x1b[31mX" * 99) if isinstance(message, Scan) and message.scan == 5 else message

    error = refusal(rewritten(bag, tmp_path / "bag", change))
    assert error.code == "AMX6831"
    assert "\x1b" not in str(error)


@pytest.mark.parametrize(
    "values",
    [
        Values((900,), (0,), (1.0,)),
        Values((0,), (5,), (1.0,)),
        Values((0,), (0,), (40000.0,)),
        Values((0,), (0,), (0.5,)),
        Values((0,), (0,), (math.nan,)),
        Values((0,), (0,), (math.inf,)),
        Values((5,), (0,), (2.0,)),
        Values((7,), (0,), (0.0,)),
        Values((0, 1), (0,), (1.0,)),
        Values((3,), (0,), (math.nan,)),
        Values((3,), (0,), (-1e300,)),
    ],
)
@pytest.mark.parametrize("field", ["latched", "read", "written", "committed"])
def test_values_that_no_variable_can_hold(bag, tmp_path, values, field):
    def change(message):
        hit = isinstance(message, Scan) and (message.task, message.scan) == ("WORK", 10)
        return message._replace(**{field: values}) if hit else message

    assert refusal(rewritten(bag, tmp_path / "bag", change)).code == "AMX6813"


@pytest.mark.parametrize("kind", [CommonImage, CommonWrite])
def test_wrong_values_in_the_write_log(bag, tmp_path, kind):
    def change(message):
        hit = isinstance(message, kind) and message.sequence in (0, 20)
        return message._replace(values=Values((2**16 - 1,), (2**32 - 1,), (1e300,))) if hit else message

    assert refusal(rewritten(bag, tmp_path / "bag", change)).code == "AMX6813"


@pytest.mark.parametrize(
    "change",
    [
        {"field": ("A",)},
        {"size": (2**32 - 1,) * 3},
        {"value": ()},
        {"value": (math.nan,) * 40},
        {"field": (), "size": (), "value": ()},
    ],
)
@pytest.mark.parametrize("where", [0, 1])
def test_wrong_states(bag, tmp_path, change, where):
    """At the start of an (edited) task, and where a state is compared."""

    def spoil(message):
        if isinstance(message, Scan) and not message.scan and not where:
            return None
        hit = isinstance(message, TaskState) and message.scan == where
        return message._replace(**change) if hit else message

    other = rewritten(bag, tmp_path / "bag", spoil)
    for new in ({}, {"SPEED": edited(SPEED, ("140 END", "139 SUM% = 0\n140 END"))}):
        try:
            report = replayed(other, new, only=("SPEED",))
        except BagError as error:
            outcome = error.code
        else:
            outcome = "replayed" if report.tasks[0].scans else "nothing"
        assert outcome in {"AMX6813", "AMX6831", "replayed"}


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_state_that_no_task_can_have(bag, tmp_path, value):
    """The filter's output is not a number: no traceback, whatever the blocks make of it."""

    def spoil(message):
        if isinstance(message, Scan) and not message.scan:
            return None
        if isinstance(message, TaskState) and message.task == "SPEED" and not message.scan:
            values = list(message.value)
            for name in ("120 LAG.y1", "120 LAG.x1"):
                if name in message.field:
                    values[list(message.field).index(name)] = value
            return message._replace(value=values)
        return message

    assert refusal(rewritten(bag, tmp_path / "bag", spoil), only=("SPEED",)).code == "AMX6813"


def test_truncated_recording(bag, tmp_path):
    data = (bag / "scans_0.mcap").read_bytes()
    for share in (0.3, 0.6, 0.95):
        file = tmp_path / "cut.mcap"
        file.write_bytes(data[: int(len(data) * share)])
        assert refusal(file).code == "AMX6812"


@given(st.binary(min_size=1, max_size=4), st.floats(0, 0.999))
@repeatable(60)
def test_damaged_bytes_never_raise_anything_else(bag, tmp_path_factory, piece, place):
    data = bytearray((bag / "scans_0.mcap").read_bytes())
    start = int(len(data) * place)
    data[start : start + len(piece)] = piece
    file = tmp_path_factory.mktemp("damaged") / "x.mcap"
    file.write_bytes(data)
    with contextlib.suppress(BagError, SourceRefused):
        replayed(file)


def test_many_differences_take_bounded_memory(tmp_path):
    """Every element of a large array differs: counted, not kept."""
    yaml = """\
rack: LINE1
slots:
  0: {module: 57C435, tick_ms: 5.5, tasks: {FILL: {priority: 4}}}
common:
  BIG%(6000): {}
"""
    text = """\
10 COMMON BIG%(6000)
20 LOCAL I%
30 CALL SCAN_LOOP(TICKS=100)
40 FOR I% = 0 TO 6000
50 BIG%(I%) = 1
60 NEXT I%
70 END
"""
    bag = record(build(tmp_path, yaml, FILL=text), tmp_path / "bag", slices=1, seconds=1.0)
    tracemalloc.start()
    report = replayed(bag, {"FILL": edited(text, ("= 1", "= 2"))})
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(report.differences) == 50
    assert report.more == 6001 - 50
    assert peak < 30_000_000
