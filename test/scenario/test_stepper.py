"""A rack a step at a time: where it halts, and what its variables are there."""

import pytest
from rack.helpers import config_at, written_in

from automax_ros.core.names import NameFault
from automax_ros.core.user_error import UserError
from automax_ros.rack.rack import Rack
from automax_ros.runtime.tasks.task import Status
from automax_ros.scenario.stepper import Change, Stepper, Why

MS = 1_000_000
RACK = """\
rack: PM1
slots:
  0: {module: 57C435, tick_ms: 1.0, tasks: {SPEED: {priority: 5}, DRAW: {priority: 8}}}
common: {REF%: {}, SUM!: {}, RUN@: {}, TABLE%(3): {}}
"""
SPEED = """\
10 COMMON REF%, SUM!, RUN@, TABLE%(3)
20 LOCAL N%, LIST%(2), NIL%
100 CALL SCAN_LOOP(TICKS=1)
110 N% = N% + 1
120 IF RUN@ THEN
130 SUM! = SUM! + N%
140 TABLE%(1) = N%
150 END_IF
160 LIST%(2) = N%
170 END
"""
DRAW = "10 LOCAL N%\n20 CALL SCAN_LOOP(TICKS=2)\n30 N% = N% + 10\n40 END\n"


def built(folder, rack=RACK, speed=SPEED, **options) -> Stepper:
    config = config_at(written_in(folder, rack, SPEED=speed, DRAW=DRAW))
    return Stepper(config, **options)


@pytest.fixture
def stepper(tmp_path) -> Stepper:
    found = built(tmp_path)
    found.start()
    return found


def test_a_time_of_the_rack_is_before_all_that_happens_then(stepper):
    halt = stepper.until(3 * MS)
    assert (halt.why, halt.at_ns, halt.task) == (Why.TIME, 3 * MS, "")
    assert stepper.value("SPEED.N%") == 3
    assert stepper.value("DRAW.N%") == 20
    assert stepper.go(500_000).at_ns == 3_500_000
    assert stepper.value("speed.n%") == 4


def test_ticks(stepper):
    assert stepper.ticks(4).at_ns == 4 * MS
    assert stepper.ticks(1, "DRAW").at_ns == 5 * MS
    assert stepper.value("DRAW.N%") == 30


def test_a_scan_of_a_task_or_of_any(stepper):
    halt = stepper.scan("DRAW")
    assert (halt.why, halt.at_ns) == (Why.DONE, 0)
    # SPEED came first at time 0, and only DRAW's scan was asked for
    assert (stepper.value("SPEED.N%"), stepper.value("DRAW.N%")) == (1, 10)
    assert (stepper.scan("DRAW").at_ns, stepper.value("SPEED.N%")) == (2 * MS, 3)
    assert (stepper.scan().at_ns, stepper.value("SPEED.N%")) == (3 * MS, 4)


def test_a_breakpoint_holds_a_scan_before_its_line(stepper):
    stepper.break_at("speed", 130)
    stepper.rack.write("RUN@", True)
    halt = stepper.go(10 * MS)
    assert (halt.why, halt.at_ns, halt.task, halt.line) == (Why.LINE, 0, "SPEED", 130)
    assert (stepper.value("SPEED.N%"), stepper.value("SUM!")) == (1, 0)
    halt = stepper.line()
    assert (halt.why, halt.line) == (Why.DONE, 140)
    assert (stepper.value("SUM!"), stepper.value("TABLE%(1)")) == (1, 0)
    assert [stepper.line().line, stepper.line().line] == [150, 160]
    assert stepper.value("TABLE%(1)") == 1
    halt = stepper.line()
    assert (halt.task, halt.line, stepper.place) == ("", 0, ("", 0))
    assert stepper.value("SPEED.LIST%(2)") == 1
    halt = stepper.go(10 * MS)
    assert (halt.at_ns, halt.line) == (MS, 130)
    stepper.clear("speed:130")
    assert stepper.go(10 * MS).why is Why.TIME


def test_lines_between_scans_begin_with_the_next_scan(stepper):
    stepper.until(MS)
    halt = stepper.line("DRAW")
    assert (halt.at_ns, halt.task, halt.line) == (2 * MS, "DRAW", 30)
    assert stepper.value("DRAW.N%") == 10
    assert stepper.line().line == 0
    assert stepper.value("DRAW.N%") == 20
    # the next scan of any task is SPEED's, held before its first statement
    halt = stepper.line()
    assert (halt.task, halt.line, halt.at_ns) == ("SPEED", 110, 3 * MS)


def test_a_change_of_a_variable_halts_and_tells_before_and_after(stepper):
    stepper.break_on("SUM!")
    stepper.break_on("table%(1)")
    assert stepper.go(5 * MS).why is Why.TIME
    stepper.rack.write("RUN@", True)
    halt = stepper.go(5 * MS)
    assert (halt.why, halt.at_ns) == (Why.CHANGE, 5 * MS)
    assert halt.changes == (Change("SUM!", 0, 6), Change("TABLE%(1)", 0, 6))
    stepper.clear("all")
    assert stepper.go(5 * MS).why is Why.TIME


def test_a_change_inside_a_held_scan_halts_at_the_line_after(stepper):
    stepper.break_on("SPEED.N%")
    stepper.break_at("SPEED", 160)
    halt = stepper.go(5 * MS)
    assert (halt.why, halt.line, halt.changes) == (Why.CHANGE, 120, (Change("SPEED.N%", 0, 1),))
    halt = stepper.go(5 * MS)
    assert (halt.why, halt.line, halt.changes) == (Why.LINE, 160, ())


def test_stepping_by_lines_changes_nothing(tmp_path, stepper):
    whole = Rack(stepper.rack.config)
    whole.start()
    whole.run(0.02)
    for task, line in (("SPEED", 110), ("SPEED", 160), ("DRAW", 30)):
        stepper.break_at(task, line)
    halts = 0
    while stepper.until(20 * MS).why is not Why.TIME:
        halts += 1
    assert halts == 2 * 20 + 10
    assert stepper.rack.state() == whole.state()
    assert {name: item.scans for name, item in stepper.rack.statistics.items()} == {"SPEED": 20, "DRAW": 10}


def test_a_fault_halts(tmp_path):
    stepper = built(tmp_path, speed=SPEED.replace("160 LIST%(2) = N%", "160 IF N% > 2 THEN 160"))
    stepper.start()
    halt = stepper.go(100 * MS)
    assert (halt.why, halt.at_ns) == (Why.STOPPED, 2 * MS)
    assert halt.cause is not None
    assert (halt.cause.code, halt.cause.task) == ("14", "SPEED")
    assert stepper.go(MS).why is Why.TIME


def test_a_held_scan_that_is_stopped_is_given_up(stepper):
    stepper.break_at("SPEED", 120)
    stepper.go(MS)
    stepper.rack.operations.stop("SPEED")
    assert stepper.place == ("", 0)
    assert stepper.rack.task("SPEED").status is Status.STOPPED
    assert stepper.value("SPEED.N%") == 0, "as before the scan: a recording knows whole scans alone"
    with pytest.raises(UserError, match="task SPEED does not run"):
        stepper.scan("SPEED")


def test_somebody_may_interrupt(tmp_path):
    asked = []
    stepper = built(tmp_path, interrupted=lambda: len(asked) >= 5 or asked.append(0) is not None)
    stepper.start()
    halt = stepper.go(10**12)
    assert halt.why is Why.INTERRUPTED
    assert halt.at_ns < 10 * MS


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda stepper: stepper.break_at("NOBODY", 10), "no task 'NOBODY'"),
        (lambda stepper: stepper.break_at("SPEED", 125), "line 125 of task SPEED holds no statement"),
        (lambda stepper: stepper.break_at("SPEED", 20), "line 20"),
        (lambda stepper: stepper.break_on("NOTHING%"), "NOTHING%"),
        (lambda stepper: stepper.break_on("SPEED.REF%"), "no variable of its own 'REF%'"),
        (lambda stepper: stepper.break_on("NOBODY.N%"), "no task 'NOBODY'"),
        (lambda stepper: stepper.value("TABLE%"), "array"),
        (lambda stepper: stepper.clear("SUM!"), "no breakpoint"),
        (lambda stepper: stepper.scan("NOBODY"), "no task"),
        (lambda stepper: stepper.ticks(1, "NOBODY"), "no task"),
    ],
)
def test_what_cannot_be_done_is_said(stepper, act, message):
    with pytest.raises((UserError, NameFault), match=message.replace("(", r"\(")):
        act(stepper)


def test_modeled_scans_cannot_be_held_at_a_line(tmp_path):
    stepper = built(tmp_path, RACK.replace("rack: PM1\n", "rack: PM1\nexecution: modeled\n"))
    stepper.start()
    with pytest.raises(UserError, match="modeled execution cannot be held"):
        stepper.break_at("SPEED", 110)
    stepper.break_on("SPEED.N%")
    halt = stepper.scan("DRAW")
    assert halt.why is Why.CHANGE
    assert stepper.scan("DRAW").why is Why.DONE
    assert stepper.rack.statistics["DRAW"].scans == 1


def test_a_basic_task_is_held_too(tmp_path):
    (tmp_path / "DIAG.BAS").write_text("10 LOCAL N%\n20 DELAY 2 TICKS\n30 N% = N% + 1\n40 GOTO 20\n50 END\n")
    tasks = "SPEED: {priority: 5}, DRAW: {priority: 8}, DIAG: {priority: 11, file: DIAG.BAS}"
    stepper = built(tmp_path, RACK.replace("SPEED: {priority: 5}, DRAW: {priority: 8}", tasks))
    stepper.start()
    stepper.break_at("DIAG", 30)
    halts = [stepper.go(10 * MS) for _ in range(3)]
    assert [(halt.at_ns, halt.task, halt.line) for halt in halts] == [(2 * MS * n, "DIAG", 30) for n in (1, 2, 3)]
    assert stepper.value("DIAG.N%") == 2
    assert stepper.line().line == 40
    assert stepper.value("DIAG.N%") == 3


def test_both_tasks_of_a_udc_are_held_in_turn(tmp_path):
    udc = (
        "10 COMMON X%\n20 LOCAL N%\n100 CALL SCAN_LOOP(TICKS=2)\n110 N% = N% + 1\n120 X% = N%\n130 END\n",
        "10 COMMON X%\n20 LOCAL SEEN%\n100 CALL SCAN_LOOP(TICKS=2)\n110 SEEN% = X%\n130 END\n",
    )
    for name, text in zip(("A", "B"), udc, strict=True):
        (tmp_path / f"{name}.BLK").write_text(text)
    module = "  6: {module: 57552, tasks: {A: {drive: A}, B: {drive: B}}}\n"
    points = "ISCR%: {slot: 6, register: 2000}, X%: {slot: 6, register: 300}, "
    rack = RACK.replace("common: {", f"{module}common: {{{points}")
    stepper = built(tmp_path, rack)
    stepper.start([("ISCR%", 64)])
    stepper.break_at("A", 120)
    stepper.break_at("B", 110)
    halts = [stepper.go(100 * MS) for _ in range(4)]
    assert [(halt.task, halt.line) for halt in halts] == [("A", 120), ("B", 110)] * 2
    assert (stepper.value("A.N%"), stepper.value("B.SEEN%")) == (2, 1)
    assert stepper.line().task == ""
    assert stepper.value("B.SEEN%") == 2
