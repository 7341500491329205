"""Module nodes under a lifecycle manager: their tasks follow the transitions, and their state the tasks."""

import shutil

import pytest
from rack.helpers import Observer
from system.support import RACKS, TYPES

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.runtime.tasks.task import Status
from ros.managing import ACTIVE, FINALIZED, INACTIVE, UNCONFIGURED, Manager
from ros.support import until

NODE = "processor_1"


class Told(Observer):
    """Observes operations."""

    def __init__(self):
        self.operations = []

    def operated(self, operation):
        self.operations.append((operation.what, operation.task, operation.ok))


@pytest.fixture
def folder(tmp_path):
    copied = tmp_path / "rack"
    shutil.copytree(RACKS / "operated", copied)
    file = copied / "rack.yaml"
    file.write_text(file.read_text().replace(", critical: true", ""))
    return copied


@pytest.fixture
def live(ros_domain_id, folder):
    from automax_ros.ros.live_rack import LiveRack

    made = LiveRack(Rack(load(folder / "rack.yaml").config))
    made.told = Told()
    made.rack.observers.add(made.told)
    made.start([])
    yield made
    made.close()


@pytest.fixture
def manager(live, client):
    return Manager(client, "/operated", lambda condition: until(live, client, condition))


def statuses(live):
    return {task.name: task.status for task in live.rack.tasks}


def test_transitions_are_operations_on_the_tasks(live, client, manager):
    assert manager.state(NODE) == manager.state("rack") == ACTIVE
    live.rack.operations.stop("LINE")
    live.told.operations.clear()
    assert manager.ask(NODE, "deactivate")
    assert manager.state(NODE) == INACTIVE
    assert manager.state("rack") == ACTIVE
    assert live.told.operations == [("stop", "SPEED", True)]
    scans = live.rack.statistics["SPEED"].scans
    assert manager.ask(NODE, 3)
    assert manager.state(NODE) == ACTIVE
    assert live.told.operations[1:] == [("run", "LINE", True), ("run", "SPEED", True)]
    until(live, client, lambda: live.rack.statistics["SPEED"].scans > scans)


def test_cleanup_deletes_and_configure_reads_the_files_again(live, client, manager, folder):
    assert not manager.ask(NODE, "cleanup"), "an active node has no such transition"
    assert "a request was refused: cleanup: a node that is active has no transition cleanup" in live.health.news()
    assert manager.ask(NODE, "deactivate"), (live.health.news(), live.rack.operations.stopped, statuses(live))
    live.told.operations.clear()
    assert manager.ask(NODE, "cleanup")
    assert manager.state(NODE) == UNCONFIGURED
    assert live.rack.operations.deleted == {"LINE", "SPEED"}
    good = (folder / "LINE.BLK").read_text()
    (folder / "LINE.BLK").write_text(good.replace("COUNT! + 1", "NIL! + 1"))
    assert not manager.ask(NODE, "configure"), "with an error in one task none is there"
    assert manager.state(NODE) == UNCONFIGURED
    assert live.rack.operations.deleted == {"LINE", "SPEED"}
    (folder / "LINE.BLK").write_text(good.replace("COUNT! + 1", "COUNT! + 1000"))
    assert manager.ask(NODE, "configure")
    assert manager.state(NODE) == INACTIVE
    assert set(statuses(live).values()) == {Status.STOPPED}
    before = live.rack.value("COUNT!")
    assert manager.ask(NODE, "activate")
    until(live, client, lambda: live.rack.value("COUNT!") >= before + 3000)
    assert live.told.operations[:2] == [("delete", "LINE", True), ("delete", "SPEED", True)]
    assert live.told.operations[-4:] == [
        ("reload", "LINE", True),
        ("reload", "SPEED", True),
        ("run", "LINE", True),
        ("run", "SPEED", True),
    ]


def test_state_follows_what_operators_do(live, manager):
    operations = live.rack.operations
    assert manager.ask("rack", "deactivate")
    assert operations.stopped.reason == "the node rack was deactivated"
    assert not operations.stopped.is_fault
    assert manager.state("rack") == manager.state(NODE) == INACTIVE
    assert set(statuses(live).values()) == {Status.STOPPED}
    operations.run("SPEED")
    assert manager.state("rack") == manager.state(NODE) == ACTIVE
    operations.stop("SPEED")
    assert manager.state(NODE) == ACTIVE, "stopping tasks one by one leaves it active"
    for name in ("LINE", "SPEED"):
        operations.delete(name)
    assert manager.state(NODE) == UNCONFIGURED
    operations.reload("SPEED", live.rack.sources["SPEED"])
    assert manager.state(NODE) == INACTIVE
    operations.stop_all("a fault", "31")
    assert manager.ask("rack", "deactivate")
    assert manager.ask("rack", "activate")
    assert statuses(live) == {"LINE": Status.STOPPED, "SPEED": Status.RUNNING}, "what was deleted stays out"


def test_shutdown_of_a_module_takes_its_tasks_out(live, manager):
    assert manager.ask(NODE, "shutdown")
    assert manager.state(NODE) == FINALIZED
    assert live.rack.operations.deleted == {"LINE", "SPEED"}
    assert not manager.ask(NODE, "configure")


def test_an_error_of_ours_stops_everything(live, manager, monkeypatch):
    from automax_ros.rack.operator.module_tasks import ModuleTasks

    def broken(_):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(ModuleTasks, "stop", broken)
    live.rack.write("REF%", 5)
    assert not manager.ask(NODE, "deactivate")
    assert manager.state(NODE) == UNCONFIGURED
    assert "a transition of processor_1 failed" in live.rack.operations.stopped.reason
    assert live.rack.value("OUT%") == 0
    assert set(statuses(live).values()) == {Status.STOPPED}
    assert any("a bug" in text for text in live.health.news())


def test_a_critical_task_does_not_stop_alone(ros_domain_id, client):
    from automax_ros.ros.live_rack import LiveRack

    live = LiveRack(Rack(load(RACKS / "operated" / "rack.yaml").config))
    try:
        live.start([])
        manager = Manager(client, "/operated", lambda condition: until(live, client, condition))
        assert not manager.ask(NODE, "deactivate")
        assert manager.state(NODE) == ACTIVE
        assert set(statuses(live).values()) == {Status.RUNNING}, "all of them or none"
    finally:
        live.close()


def test_without_an_operator_nobody_may_ask(ros_domain_id, client):
    from automax_ros.ros.live_rack import LiveRack

    live = LiveRack(Rack(load(TYPES).config))
    try:
        live.start([])
        manager = Manager(client, "/types", lambda condition: until(live, client, condition))
        for node in ("rack", NODE):
            assert not manager.ask(node, "deactivate")
            assert manager.state(node) == ACTIVE
        assert set(statuses(live).values()) == {Status.RUNNING}
    finally:
        live.close()
