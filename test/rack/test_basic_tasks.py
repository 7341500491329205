"""BASIC tasks in a rack: events, channels between Processors, operations, states, modeled execution."""

from __future__ import annotations

import pytest
from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.rack.rack import Rack
from automax_ros.runtime.tasks.task import Status
from automax_ros.runtime.time.scheduler import EventClass, EventKey
from rack.helpers import rack_at, run_for

TICK = 5_500_000
COUNT = "10 COMMON N%\n20 START EVERY 2 TICKS\n30 N% = N% + 1\n40 END\n"
SENDER = """10 COMMON SENT%
20 LOCAL K%
30 OPEN CHANNEL FOR OUTPUT AS FILE #9, TYPE = (I, S)
40 K% = K% + 1
50 PRINT #9, K%, "NUMBER " + STR$(K%)
60 SENT% = K%
70 DELAY 1 TICKS
80 IF K% < 20 THEN 40
90 END
"""
RECEIVER = """10 COMMON GOT%, TEXT$
20 LOCAL A%, A$
30 OPEN CHANNEL FOR INPUT AS FILE #9, TYPE = (I, S), DEPTH = 3
40 INPUT #9, A%, A$
50 GOT% = GOT% + A%
60 TEXT$ = A$
70 IF A% = 5 THEN DELAY 10 TICKS
80 GOTO 40
90 END
"""
SETTER = """10 COMMON TICKS%
15 EVENT NAME = GO_ON
20 CALL SCAN_LOOP(TICKS=1)
30 TICKS% = TICKS% + 1
40 IF TICKS% = 3 OR TICKS% = 4 THEN SET GO_ON
50 END
"""
WAITER = """10 COMMON SEEN%(9), M%
15 COMMON TICKS%
20 EVENT NAME = GO_ON
30 DELAY 6 TICKS
40 WAIT ON GO_ON
50 SEEN%(M%) = TICKS%
60 M% = M% + 1
70 GOTO 40
80 END
"""


def rack_of(tmp_path, tasks: dict[str, tuple[int, str]], *, execution: str = "ideal", interrupts: bool = False) -> Rack:
    """A rack of two Processors: by task its slot and its source; BASIC tasks are those without SCAN_LOOP."""
    for name, (_, source) in tasks.items():
        suffix = "BLK" if "SCAN_LOOP" in source else "BAS"
        (tmp_path / f"{name}.{suffix}").write_text(source)
    slots = "".join(
        f"  {slot}:\n    module: 57C435\n    tick_ms: 5.5\n    tasks:\n"
        + "".join(
            f"      {name}: {{priority: {4 + place}}}\n"
            for place, (name, (at, _)) in enumerate(tasks.items())
            if at == slot
        )
        for slot in sorted({at for at, _ in tasks.values()})
    )
    commons = "  N%:\n  SENT%:\n  GOT%:\n  TEXT$:\n  TICKS%:\n  M%:\n  SEEN%(9):\n"
    if interrupts:
        slots += "  6: {module: 57C411}\n"
        commons += "  ISCR%: {slot: 6, register: 3}\n"
    text = f"rack: R\nexecution: {execution}\nslots:\n  0: {{module: 57C413}}\n{slots}common:\n{commons}"
    (tmp_path / "rack.yaml").write_text(text)
    rack = rack_at(tmp_path / "rack.yaml")
    rack.memory.keep_log()
    return rack


def run_ticks(rack: Rack, ticks: int) -> None:
    rack.scheduler.run_until(rack.now_ns + ticks * TICK)


def test_start_every_keeps_its_grid(tmp_path):
    rack = run_for(rack_of(tmp_path, {"COUNT": (1, COUNT)}))
    run_ticks(rack, 11)
    writes = [(write.time_ns, write.value) for write in rack.memory.drain() if write.view == rack.memory.view("N%")]
    assert writes == [(2 * number * TICK, number + 1) for number in range(6)]


def test_an_event_set_before_anybody_waits_is_kept_once(tmp_path):
    """Set in scans 3 and 4, while the waiter delays 6 ticks: it goes on once, at its first WAIT."""
    rack = run_for(rack_of(tmp_path, {"SETTER": (1, SETTER), "WAITER": (2, WAITER)}))
    run_ticks(rack, 20)
    assert rack.value("M%") == 1
    assert rack.value("SEEN%", 0) == 7


@pytest.mark.parametrize("slots", [(1, 2), (1, 1), (2, 1)])
def test_a_channel_joins_tasks_of_any_processors(tmp_path, slots):
    rack = run_for(rack_of(tmp_path, {"SENDER": (slots[0], SENDER), "RECEIVER": (slots[1], RECEIVER)}))
    run_ticks(rack, 8)
    # The receiver sleeps from the fifth message on: three more find room, the fourth waits.
    assert (rack.value("GOT%"), rack.value("SENT%")) == (15, 8)
    run_ticks(rack, 3)
    assert (rack.value("GOT%"), rack.value("SENT%")) == (15, 8)
    run_ticks(rack, 30)
    assert (rack.value("GOT%"), rack.value("TEXT$")) == (210, "NUMBER 20")
    assert rack.task("SENDER").status is Status.ENDED
    assert rack.task("RECEIVER").status is Status.RUNNING


def test_run_begins_at_the_first_statement(tmp_path):
    rack = run_for(rack_of(tmp_path, {"COUNT": (1, COUNT)}))
    run_ticks(rack, 5)
    rack.operations.stop("COUNT")
    run_ticks(rack, 5)
    assert rack.value("N%") == 3
    rack.operations.run("COUNT")
    run_ticks(rack, 4)
    assert rack.value("N%") == 5
    assert rack.task("COUNT").scan_number == 2


def test_stop_all_forgets_events_and_channels(tmp_path):
    rack = run_for(rack_of(tmp_path, {"SENDER": (1, SENDER), "RECEIVER": (2, RECEIVER), "SETTER": (1, SETTER)}))
    run_ticks(rack, 8)
    assert rack.events.pending == ("GO_ON",)
    assert rack.channels.state()
    rack.operations.stop_all("test")
    assert (rack.events.pending, rack.channels.state()) == ((), ())
    run_ticks(rack, 5)
    assert rack.value("SENT%") == 0
    rack.operations.run_all()
    run_ticks(rack, 4)
    assert rack.value("SENT%") > 0


def test_a_reload_of_another_kind_of_task_is_refused(tmp_path):
    from automax_ros.core.diagnostics import SourceText
    from automax_ros.rack.tasks.installation import RackError

    rack = run_for(rack_of(tmp_path, {"COUNT": (1, COUNT)}))
    with pytest.raises(RackError, match="is a BASIC task"):
        rack.operations.reload("COUNT", SourceText("COUNT.BLK", "10 CALL SCAN_LOOP(TICKS=4)\n20 END\n"))
    rack.operations.reload("COUNT", SourceText("COUNT.BAS", COUNT.replace("+ 1", "+ 10")))
    run_ticks(rack, 4)
    assert rack.value("N%") >= 20


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
@given(st.lists(st.tuples(st.integers(0, 11), st.integers(0, 1_500_000)), min_size=1, max_size=4))
@repeatable(15)
def test_a_state_taken_at_any_instant_goes_on_the_same(tmp_path_factory, execution, pauses):
    """Each pause is a number of ticks and ns after a tick: then modeled scans and bursts are under way."""
    tasks = {
        "SENDER": (1, SENDER),
        "RECEIVER": (2, RECEIVER),
        "SETTER": (1, SETTER),
        "WAITER": (2, WAITER),
        "COUNT": (1, COUNT),
    }
    folder = tmp_path_factory.mktemp("rack")
    whole = run_for(rack_of(folder, tasks, execution=execution))
    whole.scheduler.run_until(60 * TICK)
    rack = run_for(rack_of(folder, tasks, execution=execution))
    log = rack.memory.drain()
    for ticks, ns in pauses:
        rack.scheduler.run_until(max(rack.now_ns, rack.now_ns // TICK * TICK + ticks * TICK + ns))
        log += rack.memory.drain()
        state = rack.state()
        rack = rack_of(folder, tasks, execution=execution)
        rack.load(state)
    rack.scheduler.run_until(whole.now_ns)
    log += rack.memory.drain()
    assert [entry[1:] for entry in log] == [entry[1:] for entry in whole.memory.drain()]
    assert rack.memory.image() == whole.memory.image()


def test_a_host_that_is_late_lets_nothing_be_made_up_for(tmp_path):
    """Up to a second late each burst happens at its instant; after more the task goes on at the present."""
    rack = rack_of(
        tmp_path,
        {"COUNT": (1, COUNT), "LOOP": (2, "10 COMMON M%\n20 M% = M% + 1\n30 DELAY 1 TICKS\n40 GOTO 20\n50 END\n")},
    )
    rack.start()
    rack.scheduler.run_due(100 * TICK)
    assert (rack.value("N%"), rack.value("M%")) == (51, 101)
    rack.scheduler.run_due(10_000 * TICK)
    assert (rack.value("N%"), rack.value("M%")) == (52, 102)
    last = rack.memory.drain()[-1]
    assert last.time_ns == 10_000 * TICK
    rack.scheduler.run_due(10_010 * TICK)
    assert (rack.value("N%"), rack.value("M%")) == (57, 112)


HARDWARE = """\
10 COMMON ISCR%, N%
20 EVENT NAME=IRQ, INTERRUPT_STATUS=ISCR%, TIMEOUT=6
30 DELAY 10 TICKS
40 WAIT ON IRQ
50 N% = N% + 1
60 GOTO 40
70 END
"""


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_hardware_event_must_come_within_its_time_out(tmp_path, execution):
    """The time counts from each WAIT: not during the DELAY, and the event may come at its last instant."""
    rack = rack_of(tmp_path, {"WAITER": (1, HARDWARE)}, execution=execution, interrupts=True)
    key = EventKey(EventClass.IO, 0, "irq")
    slack = 0 if execution == "ideal" else 1_000_000
    rack.scheduler.at(16 * TICK, key, rack.events.event("IRQ").set)
    rack.scheduler.at(20 * TICK, key, rack.events.event("IRQ").set)
    rack.start()
    rack.scheduler.run_until(26 * TICK)
    assert (rack.value("N%"), rack.operations.stopped) == (2, None)
    kept = rack.state()
    rack = rack_of(tmp_path, {"WAITER": (1, HARDWARE)}, execution=execution, interrupts=True)
    rack.load(kept)
    rack.scheduler.run_until(27 * TICK)
    stopped = rack.operations.stopped
    assert stopped is not None
    assert 26 * TICK <= stopped.time_ns <= 26 * TICK + slack
    assert [entry.problem for entry in rack.task("WAITER").errors.entries] == ["AMX7071"]
    rack.operations.clear_errors("WAITER")
    rack.operations.run("WAITER")
    run_ticks(rack, 15)
    assert rack.operations.stopped is None


def test_a_loop_without_end_leaves_the_processor_to_others(tmp_path):
    busy = "10 LOCAL A%\n20 COMMON M%\n30 A% = 1 - A%\n35 M% = A%\n40 GOTO 30\n50 END\n"
    for execution in ("ideal", "modeled"):
        rack = run_for(rack_of(tmp_path, {"SETTER": (1, SETTER), "BUSY": (1, busy)}, execution=execution))
        run_ticks(rack, 20)
        assert rack.value("TICKS%") in (19, 20)
        assert rack.stop_reason is None


def test_tasks_that_wake_each_other_do_not_stop_time(tmp_path):
    events = "10 EVENT NAME = A \\ EVENT NAME = B\n"
    ping = f"{events}20 COMMON N%\n30 WAIT ON A\n40 N% = N% + 1\n50 SET B\n60 GOTO 30\n70 END\n"
    pong = f"{events}20 SET A\n30 WAIT ON B\n40 GOTO 20\n50 END\n"
    rack = run_for(rack_of(tmp_path, {"PING": (1, ping), "PONG": (1, pong)}))
    run_ticks(rack, 3)
    assert 100 < rack.value("N%") < 400
