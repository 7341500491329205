"""A drive's task compiled: every form latches, hands the inputs to the minor loop, stores what it gives, commits."""

from __future__ import annotations

import pytest

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.lowering.expressions import SUBSCRIPT
from automax_ros.compile.scan_times import scan_times
from automax_ros.core.types import DataType
from automax_ros.drive.current_loop.inputs import Inputs
from automax_ros.drive.current_loop.outputs import OUTPUTS
from compile.support import compiled_of

HEAD = """\
10 COMMON REF%, SPEED%, RUN@, COAST@, RESET@, STATE@, FB%, GAIN
20 COMMON RECORDS%(37,1), TABLE%(5), FLAGS@(3)
30 LOCAL OWN%(37,1), LAGGED%, BAD@, N%
"""
NAMES = ("REF%", "SPEED%", "RUN@", "COAST@", "RESET@", "STATE@", "FB%")
"""What a scan latches, in its order."""
VIEW = {name: view for view, name in enumerate((*NAMES, "GAIN", "RECORDS%", "TABLE%", "FLAGS@"))}


def drive(*more: str, before: str = "", **changes: str | None) -> str:
    given = {
        "IO_CNTL_SLOT": "7", "DIG_IO_SLOT": "8", "REFERENCE": "REF%", "KP": "GAIN", "PI_W_LEAD": "50.0",
        "CML_RUN": "RUN@", "IOC_THRESH": "250", "LIM_BAR": "150", "FAULT_RESET": "RESET@", **changes,
    }  # fmt: skip
    call = ", ".join(f"{name}={value}" for name, value in given.items() if value is not None)
    rest = "".join(f"{number} {line}\n" for number, line in enumerate(more, 110))
    return f"{HEAD}{before}100 CALL DC_DRIVE_CML({call})\n{rest}900 END\n"


def results(**values: int) -> tuple[int, ...]:
    """What the loop gives: all 0 but these."""
    return tuple(values.get(name, 0) for name in OUTPUTS)


class FakeIo:
    """Plays the memory and the loop; ``log`` has what was done, in order."""

    def __init__(self, *outcomes: object, forced: tuple[str, ...] = (), compiled=None, **memory: object) -> None:
        self.latched = {name: memory.get(name, DataType.INTEGER.zero) for name in NAMES}
        self.memory = memory
        self.outcomes = list(outcomes)
        self.done: list[tuple[object, ...]] = []
        self.seen: list[Inputs] = []
        self.records: list[object] = []
        self.held = tuple(name in forced for name in (compiled.written if compiled else ()))

    def latch(self):
        self.done.append(("latch",))
        return tuple(self.latched.values())

    def forces(self):
        return self.held

    def commit(self, changes):
        self.done.append(("commit", dict(changes)))

    def read_now(self, view, element=0):
        name = next(name for name, number in VIEW.items() if number == view)
        self.done.append(("read", name, element))
        return self.memory.get(f"{name}({element})" if element else name, 0)

    def write_now(self, view, value, element=0):
        self.done.append(("write", view, element, value))

    def log(self, line, code):
        self.done.append(("log", line, code))

    def minor_loop(self, inputs, records):
        self.done.append(("loop",))
        self.seen.append(Inputs(*inputs))
        self.records.append(records)
        return self.outcomes.pop(0)


def whole(form):
    def execute(compiled, io, state, scans=1):
        running = getattr(compiled, form)(state, io)
        ended = [next(running) for _ in range(scans)]
        running.close()
        return ended[-1]

    return execute


def stepped(form):
    def execute(compiled, io, state, scans=1):
        for _ in range(scans):
            steps = form(compiled)(state, io)
            try:
                while True:
                    next(steps)
            except StopIteration as end:
                ended = end.value
        return ended

    return execute


FORMS = {
    "scans": whole("scans"),
    "scans_forced": whole("scans_forced"),
    "scan_steps": stepped(lambda compiled: compiled.scan_steps),
    "scan_steps_forced": stepped(lambda compiled: compiled.scan_steps_forced),
    "scan_lines": stepped(lambda compiled: compiled.scan_lines.scan),
}
each_form = pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)


def executed(form, text, *outcomes, state=None, forced=(), scans=1, **memory):
    compiled = compiled_of(text)
    assert compiled.latched == NAMES
    state = compiled.layout.fresh() if state is None else state
    io = FakeIo(*outcomes, forced=forced, compiled=compiled, **memory)
    ended = form(compiled, io, state, scans)
    return io, dict(zip((field.name for field in compiled.layout.fields), state, strict=True)), ended


@each_form
def test_the_loop_gets_latch_memory_literals_and_defaults(form):
    text = drive(
        SPEED_FDBK="SPEED%", CML_COAST_STOP="-COAST@", REFERENCE="TABLE%(3)", MCR_SELECT="TRUE", OSV_THRESH="N%"
    )
    memory = {"SPEED%": -7, "RUN@": True, "COAST@": True, "RESET@": False, "GAIN": 0.25, "TABLE%(3)": 1234}
    io, _, ended = executed(form, text, None, **memory)
    assert not ended
    assert io.seen == [
        Inputs(7, 8, 60, 1234, 0.0, 200.0, 0.25, 50.0, 1, 0, True, False, True, 0.1, False, False, 180, 250, 150, True,
               -7, True, None, 0, False, False, False)
    ]  # fmt: skip
    assert io.done == [("latch",), ("read", "TABLE%", 3), ("read", "GAIN", 0), ("loop",)]


@each_form
def test_programmed_outputs_go_to_the_latch_the_memory_and_the_locals(form):
    text = drive(
        DC_CML_STATE="STATE@", I_FDBK="FB%", REF_LAG_OUT="LAGGED%", BAD_SCR_NUM="TABLE%(2)", IOC_OUT="FLAGS@(1)"
    )
    given = results(DC_CML_STATE=True, I_FDBK=-55, REF_LAG_OUT=77, BAD_SCR_NUM=4, IOC_OUT=True, DELTA=9999)
    io, state, _ = executed(form, text, given)
    assert state["LAGGED%"] == 77
    writes = [item[1:] for item in io.done if item[0] == "write"]
    assert sorted(writes) == sorted([(VIEW["TABLE%"], 2, 4), (VIEW["FLAGS@"], 1, True)])
    assert io.done[-1] == ("commit", {VIEW["STATE@"]: True, VIEW["FB%"]: -55})


@each_form
def test_between_two_ticks_nothing_is_written(form):
    text = drive(
        DC_CML_STATE="STATE@", I_FDBK="FB%", REF_LAG_OUT="LAGGED%", BAD_SCR_NUM="TABLE%(2)", IOC_OUT="FLAGS@(N%)"
    )
    io, state, _ = executed(form, text, None, **{"STATE@": True, "FB%": 3})
    assert state["LAGGED%"] == 0
    assert [item[0] for item in io.done] == ["latch", "read", "loop"]


@each_form
def test_a_bad_subscript_is_logged_where_something_is_written_alone(form):
    text = drive(IOC_OUT="FLAGS@(N%)", before="40 N% = 9\n")
    compiled = compiled_of(text)
    state = compiled.layout.fresh()
    state[compiled.layout.index("N%")] = 9
    io, _, _ = executed(form, text, None, results(IOC_OUT=True), state=state, scans=2)
    assert [item for item in io.done if item[0] in ("log", "write")] == [("log", 100, SUBSCRIPT)]


@each_form
def test_equal_values_are_not_committed(form):
    io, _, _ = executed(form, drive(I_FDBK="FB%"), results(I_FDBK=3), **{"FB%": 3})
    assert io.done[-1] == ("loop",)


@each_form
def test_blocks_after_the_loop_see_what_it_wrote(form):
    more = ("CALL INVERTER(INPUT=FB%, OUTPUT=N%)", "LAGGED% = N% * 2")
    io, state, _ = executed(form, drive(*more, I_FDBK="FB%"), results(I_FDBK=-6))
    assert (state["N%"], state["LAGGED%"]) == (6, 12)
    assert io.done[-1] == ("commit", {VIEW["FB%"]: -6})


@each_form
def test_jumps_after_the_loop_repeat_nothing_of_it(form):
    more = ("N% = N% + 1", "IF N% < 5 THEN 110", "GOSUB 115", "LAGGED% = N%", "GOTO 900", "N% = N% * 10", "RETURN")
    io, state, _ = executed(form, drive(*more), None)
    assert (state["N%"], state["LAGGED%"]) == (50, 50)
    assert io.done == [("latch",), ("read", "GAIN", 0), ("loop",)]


@each_form
def test_stop_ends_the_task_without_a_commit(form):
    io, _, ended = executed(form, drive("STOP", I_FDBK="FB%"), results(I_FDBK=1))
    assert ended
    assert io.done[-1] == ("loop",)


@each_form
def test_local_records_are_the_tasks_own_array(form):
    compiled = compiled_of(drive(DIAG_DATA="OWN%"))
    state = compiled.layout.fresh()
    own = state[compiled.layout.index("OWN%")]
    io, _, _ = executed(form, drive(DIAG_DATA="OWN%"), None, state=state)
    assert io.records[0] is own
    assert len(own) == 76
    assert executed(form, drive(DIAG_DATA="RECORDS%"), None)[0].records == [None]
    assert executed(form, drive(), None)[0].records == [None]


@pytest.mark.parametrize("form", ["scans_forced", "scan_steps_forced"])
def test_a_forced_output_keeps_its_value_inside_the_scan(form):
    more = ("CALL INVERTER(INPUT=FB%, OUTPUT=N%)",)
    io, state, _ = executed(FORMS[form], drive(*more, I_FDBK="FB%"), results(I_FDBK=-6), forced=("FB%",), **{"FB%": 40})
    assert state["N%"] == -40
    assert io.done[-1] == ("loop",)


def test_what_stands_before_the_call_runs_once_at_run():
    text = drive(before="40 N% = 3 \\ REF% = 5\n50 IF N% = 3 THEN GAIN = 0.5\n")
    compiled = compiled_of(text)
    state, io = compiled.layout.fresh(), FakeIo()
    assert not compiled.startup(state, io)
    assert state[compiled.layout.index("N%")] == 3
    assert io.done == [("write", VIEW["REF%"], 0, 5), ("write", VIEW["GAIN"], 0, 0.5)]


def test_outputs_that_blocks_may_change_are_those_that_end_commits():
    text = drive("CALL INVERTER(INPUT=N%, OUTPUT=REF%)", I_FDBK="FB%", BAD_SCR_OUT="FLAGS@(1)", DIAG_DATA="RECORDS%")
    assert compiled_of(text).written == ("REF%", "FB%")


def test_a_task_with_nothing_but_its_call():
    text = (
        "10 LOCAL R%, B@\n20 CALL DC_DRIVE_CML(IO_CNTL_SLOT=0, DIG_IO_SLOT=15, REFERENCE=R%, KP=1.0, PI_W_LEAD=10.0,"
        " CML_RUN=B@, IOC_THRESH=100, LIM_BAR=100, FAULT_RESET=B@)\n30 END\n"
    )
    compiled = compiled_of(text)
    io = FakeIo(results())
    io.latched = {}
    FORMS["scans"](compiled, io, compiled.layout.fresh())
    assert io.done == [("latch",), ("loop",)]


def test_stepping_stops_at_the_call():
    assert 100 in compiled_of(drive("N% = 1")).scan_lines.lines


# Time

LATCH_US, END_US, ESTIMATE_US = 80.0 + 7 * 1.6 + 3 * 2.5 + 4 * 3.8, 13.82 + 7 * 2.0 + 3 * 1.6 + 4 * 2.2, 250.0
"""Of a 7010, by table 4: 7 commons are latched, 3 INTEGERs and 4 BOOLEANs; the loop's is the estimate."""


def test_a_scan_takes_the_latch_the_estimate_and_the_end():
    model = CostModel(Model.MODEL_7010)
    times = scan_times(compiled_of(drive()).program, model)
    assert times.least_ns == times.most_ns == pytest.approx(1000 * (LATCH_US + ESTIMATE_US + END_US), abs=3)
    assert times.estimated
    assert not scan_times(compiled_of(drive()).program, CostModel()).estimated


def test_in_steps_the_loop_is_executed_when_its_time_has_passed():
    compiled = compiled_of(drive(), CostModel(Model.MODEL_7010))
    io, passed, at = FakeIo(results()), 0, {}
    steps = compiled.scan_steps(compiled.layout.fresh(), io)
    for cost in steps:
        passed += cost
        at[len(io.done)] = passed
    assert io.done == [("latch",), ("read", "GAIN", 0), ("loop",)]
    assert at[0] == pytest.approx(1000 * LATCH_US, abs=2)
    assert at[1] == at[0]
    assert at[2] == pytest.approx(1000 * (LATCH_US + ESTIMATE_US), abs=3)
    assert passed == scan_times(compiled.program, CostModel(Model.MODEL_7010)).most_ns


def test_a_6010_takes_four_times_the_estimate():
    def without_estimate(model):
        times = CostModel(model)
        program = compiled_of(drive()).program
        return scan_times(program, times).most_ns - times.scan_loop_ns(program) - times.end_ns(program)

    assert without_estimate(Model.MODEL_6010) == 4 * without_estimate(Model.MODEL_7010) == 1_000_000
