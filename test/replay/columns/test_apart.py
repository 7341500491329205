"""An edited task goes by columns where it differs, too, and its report is that of scan by scan.

That the reports are the same ``test/replay/conftest.py`` proves for every replay of these rooms.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import strategies as st
from rack.helpers import rack_from
from soaking import holds_for

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeMode
from automax_ros.core.diagnostics import SourceText
from automax_ros.messages.types.messages import CommonWrite, Scan
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay.columns.apart import ApartStretches
from automax_ros.replay.engine import Replay, ReplayOptions
from automax_ros.replay.scans.report import ReplayReport
from replay.replays import edited, record, rewritten

FORMS = {"python": IN_PYTHON, "native": NativeForms(NativeMode.ON)}
SPEED = """\
10 COMMON REF%, OUT%, LOW@, LAST%
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], SUM%, FILTERED%
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=REF%, INPUT2=TRIM%, OUTPUT=SUM%)
120 CALL LAG(INPUT=SUM%, WLG=10.0, OUTPUT=FILTERED%)
130 CALL SUMMER(INPUT1=FILTERED%, INPUT2=REF%, OUTPUT=OUT%)
140 CALL COMPARE(INPUT1=OUT%, INPUT2=100, OUTPUT_LES=LOW@)
150 CALL SUMMER(INPUT1=LAST%, INPUT2=300, OUTPUT=LAST%)
160 END
"""
OTHER = """\
10 COMMON REF%, OUT%, COPY%, UNREAD%
100 CALL SCAN_LOOP(TICKS=3)
110 CALL SUMMER(INPUT1=REF%, INPUT2=COPY%, OUTPUT=UNREAD%)
120 IF REF% > 400 THEN COPY% = REF%
130 END
"""
YAML = """\
rack: LINE1
slots:
  0:
    module: 57C435
    tick_ms: 5.5
    tasks:
      SPEED: {priority: 4}
      OTHER: {priority: 8}
common: {REF%: {}, OUT%: {}, LOW@: {}, LAST%: {}, COPY%: {}, UNREAD%: {}, T%(3): {}, NEW%: {}}
"""
EDITS = {
    "a gain": (("WLG=10.0", "WLG=14.0"),),
    "a tunable": (("CURRENT=1", "CURRENT=4"),),
    "a common that it never read": (("20 LOCAL", "15 COMMON UNREAD%\n20 LOCAL"), ("INPUT2=TRIM%", "INPUT2=UNREAD%")),
    "its locals": (
        ("SUM%, FILTERED%", "FILTERED%, SUM%, MORE%"),
        ("150 CALL", "145 MORE% = SUM% + 1\n150 CALL"),
        ("WLG=10.0", "WLG=11.0"),
    ),
    "a common that nobody writes": (("20 LOCAL", "15 COMMON NEW%\n20 LOCAL"), ("OUTPUT=OUT%", "OUTPUT=NEW%")),
    "an output less": (("140 CALL COMPARE(INPUT1=OUT%, INPUT2=100, OUTPUT_LES=LOW@)\n", ""), ("WLG=10.0", "WLG=9.0")),
    "a count of its own": (("INPUT2=300", "INPUT2=500"),),
    "an error in some scans": (
        ("SUM%, FIL", "SUM%, NIL%, FIL"),
        ("160 END", "155 IF LAST% > 200 THEN NIL% = 1 / NIL%\n160 END"),
    ),
    "another's output": (("20 LOCAL", "15 COMMON COPY%\n20 LOCAL"), ("OUTPUT=OUT%", "OUTPUT=COPY%")),
    "a write outside of the latch": (("160 END", "155 IF OUT% > 150 THEN OUT% = 7\n160 END"),),
    "a statement that writes": (("20 LOCAL", "15 COMMON NEW%\n20 LOCAL"), ("160 END", "155 NEW% = FILTERED%\n160 END")),
    "an array": (("20 LOCAL", "15 COMMON T%(3)\n20 LOCAL"), ("160 END", "155 T%(0) = FILTERED%\n160 END")),
    "an end": (("160 END", "155 IF LAST% > 20000 THEN STOP\n160 END"),),
}


@pytest.fixture(autouse=True)
def columns_are_available(column_library) -> None:
    if column_library is None:
        pytest.skip("there is no C compiler")


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many scans went by columns whether or not they differed, a number for each time."""
    counts: list[int] = []
    take = ApartStretches.take

    def counted(self: ApartStretches, scans, writes, *, counted: bool) -> int:
        counts.append(take(self, scans, writes, counted=counted))
        return counts[-1]

    monkeypatch.setattr(ApartStretches, "take", counted)
    return counts


def moves(rack, number: int) -> None:
    """What the plant does between two slices of the run, and an operator once: the task's own output is set."""
    rack.write("REF%", (number // 8 * 137) % 500)
    if number == 25:
        rack.write("OUT%", -5)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rack = rack_from(tmp_path_factory.mktemp("apart"), YAML, SPEED=SPEED, OTHER=OTHER)
    return record(rack, tmp_path_factory.mktemp("bags") / "bag", moves, slices=40, seconds=4.0)


WRITES = "156 IF A% > 250 THEN NEW% = A%\n"


def with_statements(read: str) -> str:
    """The task with statements outside of its latch, which read an output or a local."""
    return edited(
        SPEED,
        ("LAST%\n20", "LAST%, NEW%\n20"),
        ("FILTERED%\n", "FILTERED%, A%\n"),
        ("160 END", f"153 IF {read} > 150 THEN A% = {read}\n{WRITES}160 END"),
    )


@pytest.fixture(scope="module", params=["OUT%", "FILTERED%"])
def statements(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A recording of that task, and its text."""
    text = with_statements(request.param)
    rack = rack_from(tmp_path_factory.mktemp("statements"), YAML, SPEED=text, OTHER=OTHER)
    return record(rack, tmp_path_factory.mktemp("bags") / "bag", moves, slices=40, seconds=4.0), text


def report(bag: Path, text: str, native: NativeForms = IN_PYTHON, **options) -> ReplayReport:
    return Replay(bag, {"SPEED": SourceText("SPEED.BLK", text)}, ReplayOptions(native=native, **options)).run()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("edit", EDITS)
def test_each_edit_gives_the_report_of_scan_by_scan(bag: Path, edit: str, form: str):
    found = report(bag, edited(SPEED, *EDITS[edit]), FORMS[form])
    assert not found.identical


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "change",
    [
        ("WLG=10.0", "WLG=14.0"),
        (WRITES, ""),
        ("A% > 250", "A% > 200"),
        ("INPUT2=300", "INPUT2=400"),
    ],
)
def test_statements_outside_of_the_latch_too(statements: tuple[Path, str], change: tuple[str, str], form: str):
    bag, text = statements
    assert not report(bag, edited(text, change), FORMS[form]).identical


def test_scans_that_take_time(tmp_path: Path):
    yaml = YAML.replace("slots:", "execution: modeled\nslots:")
    rack = rack_from(tmp_path, yaml, SPEED=SPEED, OTHER=OTHER)
    bag = record(rack, tmp_path / "bag", moves, slices=40, seconds=4.0)
    assert not report(bag, edited(SPEED, *EDITS["a gain"])).identical
    assert not report(bag, edited(SPEED, *EDITS["a statement that writes"])).identical


def test_files_that_begin_with_an_image_and_a_task_that_stops_and_runs_again(tmp_path: Path):
    def stops(rack, number: int) -> None:
        moves(rack, number)
        if number in (12, 15):
            (rack.operations.stop if number == 12 else rack.operations.run)("SPEED")

    rack = rack_from(tmp_path, YAML, SPEED=SPEED, OTHER=OTHER)
    bag = record(rack, tmp_path / "bag", stops, slices=40, seconds=4.0, options=RecordingOptions(split_ns=700_000_000))
    assert not report(bag, edited(SPEED, *EDITS["a gain"])).identical


def test_a_gap_in_the_log_of_writes(bag: Path, tmp_path: Path):
    def change(message):
        return (
            message._replace(sequence=message.sequence + 3)
            if isinstance(message, CommonWrite) and message.sequence > 300
            else message
        )

    other = rewritten(bag, tmp_path / "other", change)
    found = report(other, edited(SPEED, *EDITS["a common that it never read"]))
    assert not found.identical


def test_a_latch_that_is_not_what_was_written_before_is_believed(bag: Path, tmp_path: Path):
    """No recorder writes that, but a recording may hold anything."""

    def change(message):
        if not isinstance(message, Scan) or message.task != "SPEED" or message.scan % 90 or not message.latched.value:
            return message
        return message._replace(latched=message.latched._replace(value=[value + 40 for value in message.latched.value]))

    other = rewritten(bag, tmp_path / "other", change)
    assert not report(other, edited(SPEED, *EDITS["a gain"])).identical


@pytest.mark.parametrize("options", [{"tolerance": 2.0}, {"from_ns": 1_500_000_000}, {"max_differences": 1}])
def test_with_each_option_too(bag: Path, options):
    assert not report(bag, edited(SPEED, *EDITS["a gain"], *EDITS["a count of its own"]), **options).identical


@pytest.mark.parametrize("edit", ["a gain", "a tunable", "a common that it never read", "its locals", "an output less"])
def test_nearly_all_scans_go_by_columns(taken: list[int], bag: Path, edit: str):
    found = report(bag, edited(SPEED, *EDITS[edit]))
    assert sum(taken) > 0.8 * found.tasks[0].scans


def test_two_edited_tasks_find_their_differences_in_order_of_time(bag: Path):
    new = {
        "SPEED": SourceText("SPEED.BLK", edited(SPEED, *EDITS["a gain"])),
        "OTHER": SourceText("OTHER.BLK", edited(OTHER, ("INPUT1=REF%, INPUT2=COPY%", "INPUT1=COPY%, INPUT2=7"))),
    }
    found = Replay(bag, new, ReplayOptions()).run()
    assert {item.task for item in found.differences} == {"SPEED", "OTHER"}
    times = [item.first.time_s for item in found.differences]
    assert times == sorted(times)


def test_a_forced_output_keeps_its_value(tmp_path: Path):
    def forces(rack, number: int) -> None:
        moves(rack, number)
        if number in (10, 20):
            (rack.force if number == 10 else rack.unforce)(*(("OUT%", 44) if number == 10 else ("OUT%",)))

    rack = rack_from(tmp_path, YAML, SPEED=SPEED, OTHER=OTHER)
    bag = record(rack, tmp_path / "bag", forces, slices=40, seconds=4.0)
    assert not report(bag, edited(SPEED, *EDITS["a gain"])).identical


@st.composite
def block_tasks(draw: st.DrawFn) -> str:
    """A task of blocks and statements on the commons of the rack, in any order."""
    variable = st.sampled_from(["REF%", "OUT%", "LAST%", "UNREAD%", "A%", "B%"])
    number = st.one_of(variable, st.just("7"))
    output = st.sampled_from(["OUT%", "LAST%", "NEW%", "A%", "B%"])
    lines = draw(
        st.lists(
            st.one_of(
                st.builds("CALL SUMMER(INPUT1={}, INPUT2={}, OUTPUT={})".format, number, number, output),
                st.builds(
                    "CALL LAG(INPUT={}, WLG={}, OUTPUT={})".format, variable, st.sampled_from([2.0, 9.0, 30.0]), output
                ),
                st.builds("CALL COMPARE(INPUT1={}, INPUT2={}, OUTPUT_GTR=LOW@)".format, number, number),
                st.builds("IF {} > 60 THEN A% = {}".format, number, number),
                st.builds("IF LOW@ THEN B% = 100 / {}".format, number),
                st.builds("IF {} > 300 THEN OUT% = 9".format, number),
            ),
            min_size=1,
            max_size=6,
        )
    )
    body = "\n".join(f"{110 + 10 * place} {line}" for place, line in enumerate(lines))
    head = "10 COMMON REF%, OUT%, LOW@, LAST%, UNREAD%, NEW%\n20 LOCAL A%, B%\n100 CALL SCAN_LOOP(TICKS=1)"
    return f"{head}\n{body}\n900 END\n"


@holds_for(15, block_tasks(), block_tasks(), st.booleans(), soak=(600, (block_tasks(), block_tasks(), st.booleans())))
def test_any_task_in_place_of_any_other(recorded_text: str, text: str, modeled: bool) -> None:
    yaml = YAML.replace("slots:", "execution: modeled\nslots:") if modeled else YAML
    with tempfile.TemporaryDirectory() as name:
        rack = rack_from(Path(name), yaml, SPEED=recorded_text, OTHER=OTHER)
        bag = record(rack, Path(name) / "bag", moves, slices=40, seconds=1.6)
        report(bag, text)
