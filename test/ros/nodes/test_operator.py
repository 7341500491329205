"""The operator's services and the tables of a live rack over real DDS, in one process: what they answer is true."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from ros.support import until

CONFIG = Path(__file__).parents[2] / "system" / "racks" / "operated" / "rack.yaml"


def test_a_rack_is_halted_stepped_and_resumed(live, ask) -> None:
    refused = ask("step", "Step", what="scan")
    assert (refused.ok, refused.reason) == (False, "the rack is not halted: pause it first")
    paused = ask("pause")
    assert paused.success
    at_ns, scans = live.rack.now_ns, live.rack.statistics["LINE"].scans
    assert paused.message == f"rack time is frozen at {at_ns / 1e9:.9g} s"
    status = ask("status", "ReadStatus")
    assert (status.ok, status.halted, status.time_s) == (True, True, at_ns / 1e9)
    stepped = ask("step", "Step", what="scan", task=" line ", count=3)
    assert (stepped.ok, stepped.why) == (True, "done")
    assert live.rack.statistics["LINE"].scans == scans + 3
    assert 3 <= stepped.scans <= 6
    statistics = live.rack.statistics["LINE"]
    last_ns = (statistics.scans + statistics.skipped - 1) * 11_000_000  # a busy host may have halted with a scan due
    assert stepped.time_s == live.rack.now_ns / 1e9 == max(at_ns, last_ns) / 1e9
    until_s = stepped.time_s + 0.5
    assert ask("step", "Step", what="until", until_s=until_s).time_s == pytest.approx(until_s)
    for wrong in (float("nan"), float("inf"), -1.0):
        assert not ask("step", "Step", what="until", until_s=wrong).ok
    tick = ask("step", "Step", what="tick", count=0)
    assert (tick.ok, tick.time_s) == (True, pytest.approx(until_s + 0.0055))
    resumed = ask("resume")
    assert resumed.message == f"rack time runs at {tick.time_s:.9g} s"
    assert not ask("resume").success
    assert live.health.counts["refused request"] == 5


def test_answers_say_what_is_true_now(live, ask) -> None:
    assert ask("stop", "OperateTask", task="LINE").status == "stopped"
    critical = ask("stop", "OperateTask", task="SPEED")
    assert (critical.ok, critical.status) == (False, "running")
    assert (ask("stop", "OperateTask", task="NIL").status, ask("stop", "OperateTask").status) == ("", "")
    assert ask("delete", "OperateTask", task="line").status == "deleted"
    assert [item.status for item in ask("tasks", "ReadTasks").tasks] == ["deleted", "running"]
    source = CONFIG.with_name("LINE.BLK").read_text()
    wrong = ask("reload", "Reload", task="LINE", source=source.replace("COUNT!, ", "").replace("NIL%", ""))
    assert (wrong.ok, wrong.status, bool(wrong.findings)) == (False, "deleted", True)
    again = ask("reload", "Reload", task="LINE", source=source)
    assert (again.ok, again.reason, again.status) == (True, "", "stopped")
    assert ask("run", "OperateTask", task="LINE").status == "running"
    assert ask("clear", "OperateTask", task="LINE").ok
    assert ask("clear_errors", "OperateTask").ok
    given = ask("set", "SetValue", name="ref%", value="70")
    assert (given.now, given.before) == ("70", "100")
    assert ask("set", "SetValue", name="ref%", value="70").before == "70"
    read = ask("get", "ReadValues", names=["R*"])
    assert (list(read.found), list(read.values), list(read.shown)) == (["REF%"], ["70"], [""])
    stands = ask("status", "ReadStatus")
    assert (list(stands.display_modules), list(stands.display_codes)) == (["processor_1"], [""])
    assert (list(stands.drive_faults), stands.ended) == ([], 0)
    forced = ask("force", "SetValue", name="REF%", value="5")
    assert (forced.ok, forced.now) == (True, "5")
    held = ask("set", "SetValue", name="REF%", value="6")
    assert (held.ok, held.now) == (False, "5")
    assert ask("tune", "SetValue", name="SPEED.TRIM%", value="99").now == "1"
    assert ask("tune", "SetValue", name="SPEED.TRIM%", value="9").now == "9"
    assert ask("unforce", "Unforce", names=["OUT%"]).forced == ["REF%"]
    assert ask("unforce", "Unforce").forced == []
    assert ask("stop_all").message == "0 of 2 tasks run"
    assert ask("run_all").message == "2 of 2 tasks run"
    assert ask("power", "Power", what="off").powered is False
    assert not ask("run_all").success
    assert ask("power", "Power", what="on").powered is True
    cycled = ask("power", "Power", what="cycle", off_for_s=0.01)
    assert (cycled.ok, cycled.powered) == (True, False)


def test_tables_of_tasks_and_forces_go_out_when_they_change(live, client, ask) -> None:
    from automax_msgs.msg import ForceTable, TaskTable

    tasks = client.listen(TaskTable, "/operated/tasks", latched=True, depth=100)
    forces = client.listen(ForceTable, "/operated/forces", latched=True, depth=100)
    until(live, client, lambda: tasks and forces)
    table = tasks[-1]
    assert (table.rack, table.run_id) == ("OPERATED", live.stream.run_id)
    assert [(item.task, item.module, item.slot, item.status) for item in table.tasks] == [
        ("LINE", "processor_1", 1, "running"),
        ("SPEED", "processor_1", 1, "running"),
    ]
    assert [(item.priority, item.critical, item.period_ms) for item in table.tasks] == [
        (4, False, 11.0),
        (5, True, 11.0),
    ]
    assert [item.source_hash for item in table.tasks] == [
        live.rack.task(name).compiled.program.source_hash for name in ("LINE", "SPEED")
    ]
    assert (forces[-1].most, forces[-1].forces) == (64, [])
    until(live, client, lambda: tasks[-1].tasks[0].errors == 1)
    assert tasks[-1].tasks[0].last_error.startswith("scan 3, line 120: AMX")
    ask("stop", "OperateTask", task="LINE")
    until(live, client, lambda: tasks[-1].tasks[0].status == "stopped")
    ask("force", "SetValue", name="SPEED.TRIM%", value="3")
    ask("force", "SetValue", name="REF%", value="7")
    ask("set", "SetValue", name="REF%", value="8")
    until(live, client, lambda: len(forces[-1].forces) == 1)
    (line,) = forces[-1].forces
    assert (line.name, line.value, line.under) == ("REF%", "7", "100"), "a tunable cannot be forced, nor a force be set"
    known = len(tasks), len(forces)
    end_ns = live.rack.now_ns + 2_100_000_000
    until(live, client, lambda: live.rack.now_ns > end_ns)
    assert (len(tasks), len(forces)) == known, "nothing but counts of scans has changed"
    ask("pause")
    ask("unforce", "Unforce")
    until(live, client, lambda: not forces[-1].forces)


def test_statistics_come_each_second_and_add_up(live, client) -> None:
    from automax_msgs.msg import ScanStatistics

    heard = client.listen(ScanStatistics, "/operated/statistics")
    until(live, client, lambda: len(heard) > 3)
    for before, after in pairwise(heard[1:]):
        assert after.window_s >= 1.0
        for old, new in zip(before.tasks, after.tasks, strict=True):
            assert (new.task, new.module, new.slot, new.period_ms) == (old.task, "processor_1", 1, 11.0)
            assert new.scans_total == old.scans_total + new.scans
            assert new.skipped_total == old.skipped_total + new.skipped
            # A scan counts all instants that it skips, also those after the window's end: the next one lacks them.
            beyond = new.scans + new.skipped - after.window_s / 0.011
            assert -1.1 - old.skipped <= beyond <= 1.1 + new.skipped
            assert 0 < new.execution_min_us <= new.execution_mean_us <= new.execution_max_us
            assert new.execution_max_us <= new.execution_max_total_us
            assert new.execution_min_total_us <= new.execution_min_us
            assert 0 <= new.lateness_mean_us <= new.lateness_max_us <= new.lateness_max_total_us
            assert new.load_percent == pytest.approx(new.scans * new.execution_mean_us / after.window_s / 1e4)


def test_status_and_diagnostics_show_what_the_display_shows(live, ask, client) -> None:
    from diagnostic_msgs.msg import DiagnosticArray

    heard = []
    client.node.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)
    live.rack.operations.stop_all("a module was lost", "31")

    def displayed() -> set[tuple[str, str]]:
        found = [item for message in heard for item in message.status if "processor_1: 57C" in item.name]
        values = [{pair.key: pair.value for pair in item.values} for item in found]
        return {(value["display"], value["display_meaning"].partition(":")[0]) for value in values}

    until(live, client, lambda: ("31", "bus error") in displayed())
    stands = ask("status", "ReadStatus")
    assert (list(stands.display_modules), list(stands.display_codes)) == (["processor_1"], ["31"])
    assert stands.display_meanings[0].startswith("bus error")
