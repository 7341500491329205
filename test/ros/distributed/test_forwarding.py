"""An operator of a rack of several processes: what is asked at common memory is done where its object is."""

from __future__ import annotations

import time
from contextlib import contextmanager
from functools import partial

import pytest
from messages.stream.webs import web_rack
from rack.distributed.parts import PROCESS_SLOTS, config_in
from waiting import wait_until

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.rack_files import files_of
from automax_ros.rack.rack import Rack
from ros.support import PATIENCE_NS

RUN_ID = 77


@contextmanager
def running(folder, config=None, processes=PROCESS_SLOTS, **layout_fields):
    """The parts of a rack's processes, each on a thread of its own here, begun as it hears of the start."""
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor

    from automax_ros.ros.distributed.bus import ProcessLayout
    from automax_ros.ros.rack_nodes import RackNodes

    config = config or config_in(folder)
    context = Context()
    context.init(args=["--ros-args", "--disable-stdout-logs"])
    executor = SingleThreadedExecutor(context=context)
    layout = ProcessLayout(processes, RUN_ID, **layout_fields)
    parts = [RackNodes(Rack(config, local=s), context=context, process_layout=layout) for s in processes]
    for part in parts:
        part.add_to(executor)
    waiting = list(parts)
    while waiting:
        executor.spin_once(timeout_sec=0.05)
        for part in [part for part in waiting if part.bus.epoch_ns]:
            part.start()
            waiting.remove(part)
    yield {"executor": executor, "parts": parts}
    for part in parts:
        part.close()
    executor.shutdown()
    context.try_shutdown()


@pytest.fixture
def racks(tmp_path, ros_domain_id):
    with running(tmp_path) as found:
        yield found


@pytest.fixture
def ask(racks):
    with asking(racks, "/cut1") as found:
        yield found


@contextmanager
def asking(racks, space):
    """Ask a service of the rack: by its name and the fields of the request."""
    import threading

    from automax_msgs import srv
    from std_srvs.srv import Trigger

    from automax_ros.ros.clients.rack_client import RackClient

    ended = threading.Event()

    def spin():
        while not ended.is_set():
            racks["executor"].spin_once(timeout_sec=0.02)

    spinning = threading.Thread(target=spin)
    spinning.start()
    kinds = {name: getattr(srv, name) for name in dir(srv)} | {"Trigger": Trigger}

    def call(client, kind, service, **fields):
        return client.call(kinds[kind], service, kinds[kind].Request(**fields), PATIENCE_NS)

    with RackClient(space) as client:
        client.find(PATIENCE_NS)
        yield partial(call, client)
    ended.set()
    spinning.join()


@pytest.mark.usefixtures("ros_domain_id")
def test_processes_that_hear_of_the_start_when_it_is_over_join(tmp_path):
    with running(tmp_path, start_delay_ns=0) as racks:
        home, one, two = racks["parts"]
        assert (home.bus.joining, one.bus.joining, two.bus.joining) == (False, True, True)
        wait_until(lambda: one.rack.task("ONE").scan_number > 0 and two.rack.task("TWO").scan_number > 0)


def test_what_waits_on_the_bus_is_taken_before_it_counts_as_missing(racks):
    """A process whose door was held up hears how much the other has written before it has taken any of it."""
    _, one, two = racks["parts"]
    two.bus._node.rack_context.intake.stop()
    peer, link = two.bus.peers.by_slot[1], one.bus.link
    words = next(item for item in two.bus._node.rack_context.intake._entrances if item.name.endswith("bus/presence"))
    before, told = peer.received, link.sequence + 30
    deadline = time.monotonic() + PATIENCE_NS / NS_PER_S
    while peer.presence.sequence < told and time.monotonic() < deadline:
        racks["executor"].spin_once(timeout_sec=0.01)
        words.take()
    assert peer.received >= before + 20
    assert not peer.gap
    assert two.bus.peers.owing() is None


@pytest.mark.parametrize(
    "forged",
    [{"seat": 9, "slots": (9,)}, {"standing_seat": 200}, {"standing_ns": (1 << 63) - 1}, {"epoch_ns": -5}],
    ids=str,
)
def test_a_word_that_cannot_be_true_changes_nothing(racks, forged):
    """A stop later than any other would decide for ever how the rack stands, and no later one could be told."""
    _, one, two = racks["parts"]
    word = two.bus.peers.by_slot[1].presence
    peers = dict(two.bus.peers.by_slot)
    standing = two.bus.link.standing
    stop = {"stopped": True, "standing_ns": (1 << 63) - 1, "standing_seat": 1, "process": word.process + 1}
    two.bus._take_presence(word._replace(**stop | forged), b"a stranger")
    assert two.bus.link.standing == standing
    assert two.bus.peers.by_slot == peers
    one.rack.operations.stop_all("to be told")

    def told() -> bool:
        racks["executor"].spin_once(timeout_sec=0.01)
        return two.rack.operations.stopped is not None

    wait_until(told)


def test_requests_reach_the_process_that_has_what_they_are_about(ask, racks):
    home, one, two = (part.rack for part in racks["parts"])
    told = ask("ReadTasks", "tasks")
    assert told.ok
    assert {(task.task, task.module) for task in told.tasks} == {
        ("ONE", "processor_1"),
        ("TWO", "processor_2"),
        ("WIND_A", "udc_10"),
    }
    assert ask("ReadStatus", "status").tasks == 3
    wait_until(lambda: one.task("ONE").scan_number > 0)
    assert ask("OperateTask", "stop", task="ONE").ok
    assert one.task("ONE").status.value == "stopped"
    again = ask("OperateTask", "run", task="NONE")
    assert not again.ok
    assert "NONE" in again.reason
    # Commons are the home's, locals their task's; the answer has them in the order in which they were asked for.
    found = ask("ReadValues", "get", names=["ONE.N%", "A%", "ONE.N%"])
    assert found.found == ["ONE.N%", "A%"]
    assert int(found.values[0]) == one.task("ONE").value("N%") > 0
    assert ask("OperateTask", "run", task="one").ok
    assert ask("SetValue", "force", name="ONE.N%", value="5").ok
    assert ask("SetValue", "force", name="A%", value="100").ok
    held = ask("ReadValues", "forces")
    assert dict(zip(held.found, held.values, strict=True)) == {"A%": "100", "ONE.N%": "5"}
    assert ask("Unforce", "unforce").forced == []
    assert one.forces() == two.forces() == home.forces() == []


def test_a_status_names_the_processes_that_do_not_answer(ask, racks):
    """It says what has come; an operation that needs all of them is refused by the same names."""
    racks["parts"][2].close()
    status = ask("ReadStatus", "status")
    assert status.ok
    assert (status.tasks, status.absent) == (1, ["processor_2"])
    home = ask("ReadStatus", "status", home_only=True)
    assert (home.tasks, home.absent) == (0, [])
    tasks = ask("ReadTasks", "tasks")
    assert not tasks.ok
    assert "did not answer" in tasks.reason


def test_a_stop_all_and_a_run_all_concern_every_process(ask, racks):
    home, one, two = (part.rack for part in racks["parts"])
    assert ask("Trigger", "stop_all").success
    wait_until(lambda: all(rack.operations.stopped for rack in (home, one, two)))
    assert {task.status.value for rack in (one, two) for task in rack.tasks} == {"stopped"}
    assert ask("Trigger", "run_all").success
    assert {task.status.value for rack in (one, two) for task in rack.tasks} == {"running"}
    wait_until(lambda: not any(rack.operations.stopped for rack in (home, one, two)))
    refused = ask("Trigger", "pause")
    assert not refused.success
    assert "a distributed rack" in refused.message


def test_a_source_is_reloaded_where_its_task_runs(ask, racks):
    _, one, _ = (part.rack for part in racks["parts"])
    source = one.sources["ONE"].text.replace("INPUT2=1", "INPUT2=3")
    assert ask("Reload", "reload", task="ONE", source=source).ok
    assert "INPUT2=3" in one.sources["ONE"].text
    # Whoever records the rack asks at common memory for the sources of all.
    files = {file.name: file.text for file in files_of(racks["parts"][0].rack)}
    assert set(files) == {"rack.yaml", "ONE.BLK", "TWO.BLK", "WIND_A.BLK"}
    assert files["ONE.BLK"] == source
    wrong = ask("Reload", "reload", task="ONE", source="10 NONSENSE\n")
    assert not wrong.ok
    assert wrong.findings


def test_the_table_of_tasks_is_that_of_all_processes(ask, racks):
    """It is joined where common memory is; the tasks of a process that has ended are no longer in it."""
    from automax_msgs.msg import ScanStatistics, TaskTable
    from system.support import Client

    with Client() as client:
        tables = client.listen(TaskTable, "/cut1/tasks", latched=True, depth=1)
        statistics = client.listen(ScanStatistics, "/cut1/statistics")
        whole = [("ONE", "processor_1", 1), ("TWO", "processor_2", 2), ("WIND_A", "udc_10", 10)]

        def shown() -> list[tuple[str, str, int]]:
            return [(item.task, item.module, item.slot) for item in tables[-1].tasks] if tables else []

        client.until(lambda: shown() == whole, "the table of all tasks")
        assert tables[-1].run_id == RUN_ID
        assert len(client.node.get_publishers_info_by_topic("/cut1/tasks")) == 1
        assert ask("OperateTask", "stop", task="ONE").ok
        client.until(lambda: tables[-1].tasks[0].status == "stopped", "a task that stands")
        client.until(lambda: {item.module for told in statistics for item in told.tasks} == {x[1] for x in whole})
        assert all(len({item.slot in (2, 10) for item in told.tasks}) <= 1 for told in statistics)
        racks["parts"][2].close()
        client.until(lambda: shown() == whole[:1], "the table without the process that has ended")


@pytest.mark.usefixtures("ros_domain_id")
def test_what_is_done_to_a_web_is_done_where_its_plants_are(tmp_path):
    """Of PULL, which no drive turns, too: a web holds it to the plants of the other process."""
    config = web_rack(tmp_path).config
    with running(tmp_path, config, ((0,), (7, 10))) as racks, asking(racks, "/line1") as ask:
        home, line = (part.rack for part in racks["parts"])
        assert (list(home.plants.webs), list(line.plants.webs)) == ([], ["W1", "W2"])
        assert ask("OperateControl", "web", name="W2", control="break", value="").ok
        assert line.plants.webs["W2"].broken
        assert ask("OperateControl", "plant", name="pull", control="slip", value="0.4").ok
        assert line.plants["PULL"].notes == ["slip 0.4"]
        refused = ask("OperateControl", "web", name="W9", control="break", value="")
        assert (refused.ok, refused.reason) == (False, "the rack has no web 'W9': it has none")
        senders = {topic.name: topic.plant for topic in racks["parts"][1].stream.webs.topics}
        assert senders["/line1/rolls/PULL"] == "UNWIND"
