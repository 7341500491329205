"""A rack in seven processes: starts together, scans as in one process, loses processes and goes on, ends in order."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from random import Random

import pytest
from rack.helpers import config_at

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.types.messages import NAMES, Scan
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.recordings.read.reader import BagReader
from system.distributed import PROCESS_NAMES, RINGS, Distributed, Line, copied
from system.support import PATIENCE_S, TYPES, Automax, automax, automax_here, wait_until

TASKS = {"CML", "RING_1", "RING_2", "RING_3", "RING_4", "SPEED", "WIND_A"}
STOP = "- {at: 3.0, stop: [CML, RING_1, RING_2, RING_3, RING_4, SPEED, WIND_A]}\n"
TICK_NS = 5_500_000
DENSE = "".join(f"- {{at: {tick * 0.0055 + 0.0006:.4f}, set: {{LINE_REF%: {tick}}}}}\n" for tick in range(200, 540))
"""A new reference soon after each tick: a scan that is a little late must not see it."""
KILLS = 100
RING_COMMONS = {f"{name}_{ring}!" for ring in RINGS for name in ("N", "SEEN", "SUM")}


def seen_by(scans: Iterable[Scan], config: RackConfig, start_ns: int) -> dict[tuple[str, int], tuple[float, float]]:
    """What each scan of the ring has read of the line's reference, and how far it brought its sum: by task and time."""
    views = {variable.name: view for view, variable in enumerate(config.variables)}
    found = {}
    for scan in scans:
        if scan.task.startswith("RING") and scan.scan:
            read = dict(zip(scan.read.variable, scan.read.value, strict=True))
            written = dict(zip(scan.written.variable, scan.written.value, strict=True))
            total = views[f"SUM_{scan.task[-1]}!"]
            found[scan.task, scan.stamp - start_ns] = read[views["LINE_REF%"]], written[total] - read[total]
    return found


def recorded(bag: Path) -> list[Scan]:
    return [item.message for item in BagReader(bag).messages(types={NAMES[Scan]})]


@pytest.mark.timeout(900)
def test_scans_are_those_of_one_process(ros_domain_id, tmp_path):
    """The same stimuli give each scan the same inputs at the same rack time; at rest all images hold the same."""
    rack = copied(tmp_path, more=DENSE + STOP)
    own, bag = tmp_path / "own", tmp_path / "bag"
    stimuli = rack / "stimuli.yaml"
    assert automax("run", rack, "--simulated", "--duration", "5", "--stimuli", stimuli, "--record", own).code == 0
    with Line() as line:
        scans = line.listen_raw(NAMES[Scan], "/line4/scans")
        with Distributed(rack, "--record", bag) as run:
            line.until_quiet(scans, 3 * NS_PER_S)
            ended = run.end(signal.SIGTERM)
    assert ended.code == 0, ended
    report = run.report
    assert set(report["tasks"]) == TASKS
    assert {name: told["deaths"] for name, told in report["processes"].items()} == dict.fromkeys(PROCESS_NAMES, 0)
    assert {name: told["differs"] for name, told in report["processes"].items()} == {name: [] for name in PROCESS_NAMES}
    due = 3 * NS_PER_S // TICK_NS + 1
    for ring in RINGS:
        task = report["tasks"][f"RING_{ring}"]
        assert 0 < task["scans"] <= due - task["skipped"], "the last that the host has made late are not counted"
        assert report["commons"][f"N_{ring}!"] == task["scans"], "no write was lost, none came twice"
    config = config_at(rack / "rack.yaml")
    alone = seen_by(recorded(own), config, 0)
    together = seen_by((decode(NAMES[Scan], item) for item in scans), config, line.began_ns)
    assert len(set(alone.values())) > 300, "the reference has many values"
    scanned = sum(report["tasks"][f"RING_{ring}"]["scans"] for ring in RINGS)
    assert scanned / 2 < len(together) <= scanned, "on a busy host the test finds a process late"
    assert together.items() <= alone.items()
    assert seen_by(recorded(bag), config, line.began_ns).items() <= alone.items()


@pytest.mark.timeout(900)
def test_processes_that_are_killed_come_back_and_nobody_else_is_disturbed(ros_domain_id, tmp_path):
    rack = copied(tmp_path)
    with Distributed(rack) as run, Line() as line:
        line.until_it_scans()
        for pid in run.process_ids.values():
            mapped = Path(f"/proc/{pid}/maps").read_text()
            assert "/dev/shm/fastrtps_" not in mapped, "who is killed leaves it in a state that others wait for"
        for name, slot in (("processor_2", 2), ("common_memory", 0)):
            before, life = dict(line.values), line.processes[slot].process
            run.kill(name)
            line.until_new(slot, life)
            line.until_it_scans()
            assert all(line.values[f"N_{ring}"] > before[f"N_{ring}"] for ring in RINGS), "counters go on"
        line.halt()
        ended = run.end(signal.SIGTERM)
    assert (ended.code, ended.err.count("Traceback")) == (0, 0), ended
    report = run.report
    deaths = {name: told["deaths"] for name, told in report["processes"].items()}
    assert deaths == dict.fromkeys(PROCESS_NAMES, 0) | {"processor_2": 1, "common_memory": 1}
    assert all(told["told"] for told in report["processes"].values())
    others = {name: RING_COMMONS & set(told["differs"]) for name, told in report["processes"].items()}
    assert others == {name: set() for name in PROCESS_NAMES}, report["commons"]
    for name in ("processor_2", "common_memory"):
        assert f"{name} was ended by SIGKILL: it is started again in " in ended.out
    for ring in (1, 3, 4):
        halted = report["commons"][f"N_{ring}!"]
        assert 0 < halted <= report["tasks"][f"RING_{ring}"]["scans"], "each scan of a life counts once"


@pytest.mark.timeout(900)
def test_stop_all_when_a_process_is_lost(ros_domain_id, tmp_path):
    rack = copied(tmp_path, rule="stop_all")
    with Distributed(rack, "--no-restart") as run, Line() as line:
        line.until_it_scans()
        killed_ns = time.time_ns()
        run.kill("processor_3")
        line.until(lambda: all(item.stopped for slot, item in line.processes.items() if slot != 3), "all stop")
        ended = run.end(signal.SIGINT)
    report = run.report
    noticed_ns = line.began_ns + round(report["stopped"]["time_s"] * NS_PER_S)
    print(f"noticed {(noticed_ns - killed_ns) / NS_PER_MS:.1f} ms after the kill")
    assert 0 <= noticed_ns - killed_ns < 5 * NS_PER_S
    assert (report["stopped"]["code"], ended.code) == ("31", 1)
    assert "processor_3 is lost" in report["stopped"]["reason"]
    assert {task["status"] for task in report["tasks"].values()} == {"stopped"}
    assert sorted(report["tasks"]) == sorted(TASKS - {"RING_3"})
    assert report["processes"]["processor_3"] == {"deaths": 1, "told": False, "differs": []}


def test_processes_end_with_whoever_started_them(ros_domain_id, tmp_path):
    rack = shutil.copytree(TYPES.parent, tmp_path / "rack")
    file = rack / "rack.yaml"
    file.write_text(file.read_text().replace("rack: TYPES", "rack: TYPES\non_module_loss: hold"))
    names = {"common_memory", "processor_1", "processor_2"}
    with Distributed(rack) as run:
        wait_until(lambda: set(run.process_ids) == names)
        second = automax_here("run", rack, "--distributed")
        assert (second.code, "runs already" in second.err) == (2, True)
        whole = automax_here("run", rack)
        assert (whole.code, "distributed over several processes" in whole.err) == (2, True)
        pids = list(run.process_ids.values())
        assert len(pids) == len(names)
        run.send(signal.SIGKILL)
        wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in pids))


@pytest.mark.soak
@pytest.mark.timeout(600)
def test_seven_processes_scan_for_a_minute(ros_domain_id, tmp_path):
    """What part of their scans they skip is printed: a machine's cores decide it (bench/distributed.py)."""
    with Distributed(copied(tmp_path), "--duration", "60") as run:
        run.process.wait(60 + PATIENCE_S)
        assert run.end().code == 0
    tasks = run.report["tasks"].values()
    skipped, done = (sum(task[key] for task in tasks) for key in ("skipped", "scans"))
    print(f"{done} scans, {skipped} skipped: {100 * skipped / (done + skipped):.4f} %")
    assert {task["status"] for task in tasks} == {"running"}
    assert skipped < 0.5 * (done + skipped)


@pytest.mark.soak
@pytest.mark.timeout(7200)
def test_a_hundred_random_kills(ros_domain_id, tmp_path):
    """Nobody else is disturbed, no value is wrong, nothing hangs; each death is noticed and made good."""
    random = Random(5)
    places = dict(zip(PROCESS_NAMES, (0, 1, 2, 3, 4, 5, 10), strict=True))
    killed: Counter[str] = Counter()
    with Distributed(copied(tmp_path)) as run, Line() as line:
        line.until_it_scans()
        for _ in range(KILLS):
            name = random.choice(PROCESS_NAMES)
            before, life = dict(line.values), line.processes[places[name]].process
            run.kill(name)
            killed[name] += 1
            line.until_new(places[name], life)
            line.until_it_scans()
            assert all(line.values[f"N_{ring}"] > before[f"N_{ring}"] for ring in RINGS), f"after a kill of {name}"
            # Three deaths of one process within 10 s would be too many.
            line.spin(random.uniform(0, 4))
        line.halt()
        ended = run.end(signal.SIGTERM)
    assert (ended.code, ended.err.count("Traceback")) == (0, 0), ended
    report = run.report
    assert {name: told["deaths"] for name, told in report["processes"].items() if told["deaths"]} == killed
    assert not any(RING_COMMONS & set(told["differs"]) for told in report["processes"].values())


def test_two_racks_of_one_name_are_told_to_both(ros_domain_id, tmp_path):
    """Locks in different folders stand for different hosts."""
    environments = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        environments.append({**os.environ, "TMPDIR": str(tmp_path / name)})
    with (
        Automax("run", TYPES, environment=environments[0]) as one,
        Automax("run", TYPES, environment=environments[1]) as two,
    ):
        for process in (one, two):
            process.wait_for_line("another rack is named TYPES: their messages cannot be distinguished")
        assert [process.end(signal.SIGTERM).code for process in (one, two)] == [0, 0]
