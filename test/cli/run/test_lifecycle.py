"""The transitions of the node ``rack`` in the program itself: what fails leaves nothing on."""

import shutil

import pytest
from system.support import RACKS

from automax_ros.cli.output.signals import StopRequest
from automax_ros.cli.run.live import LiveSession
from automax_ros.cli.run.plan import RunPlan
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.loader import load
from automax_ros.recordings.write.recorder import RecordingOptions

INACTIVE, ACTIVE, UNCONFIGURED, FINALIZED = "inactive", "active", "unconfigured", "finalized"


@pytest.fixture
def folder(tmp_path):
    copied = tmp_path / "rack"
    shutil.copytree(RACKS / "operated", copied)
    return copied


@pytest.fixture
def plan(folder, tmp_path):
    config = load(folder / "rack.yaml").config
    return RunPlan(config, None, None, RecordingOptions(), (), (), tmp_path / "state")


@pytest.fixture
def stop():
    return StopRequest()


@pytest.fixture
def run(ros_domain_id, plan, stop):
    from automax_ros.cli.run.lifecycle import LifecycleRun, LifecycleRunner
    from automax_ros.ros.setup.process import RosProcess

    process = RosProcess()
    made = LifecycleRunner(LifecycleRun("operated", lambda: plan, plan), process, stop, ros_domain_id)
    yield made
    made.finish()
    made.leave()
    process.close()


def change(run, transition):
    """Carry a transition out and return what it ended with."""
    ended = []
    run._node.change(transition, ended.append)
    return ended[0]


def test_transitions_end_where_they_should(run):
    assert run._node.state == UNCONFIGURED
    assert change(run, "configure") is None
    assert run._node.state == INACTIVE
    assert change(run, "activate") is None
    rack = run._session.rack
    assert all(task.status.value == "running" for task in rack.tasks)
    assert change(run, "deactivate") is None
    assert rack.operations.stopped.reason == "the node rack was deactivated"
    assert change(run, "cleanup") is None
    assert run._session is None
    assert run.code == 0


@pytest.mark.parametrize("transition", ["activate", "deactivate"])
def test_an_error_of_ours_leaves_nothing_on(run, monkeypatch, transition):
    from automax_ros.ros.rack_nodes import RackNodes

    change(run, "configure")
    if transition == "deactivate":
        change(run, "activate")
    rack = run._session.rack

    def broken(*_, **__):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(LiveSession, "start", broken)
    monkeypatch.setattr(RackNodes, "deactivate", broken)
    error = change(run, transition)
    assert isinstance(error, ZeroDivisionError)
    assert run._node.state == UNCONFIGURED
    assert "failed" in rack.operations.stopped.reason
    assert not any(task.status.value == "running" for task in rack.tasks)
    assert run._session is None
    monkeypatch.undo()
    assert change(run, "configure") is None, "and it can be tried again"


def test_what_cannot_even_be_stopped_ends_the_program(run, monkeypatch):
    change(run, "configure")

    def broken(*_):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(LiveSession, "start", broken)
    monkeypatch.setattr(LiveSession, "finish", broken)
    assert isinstance(change(run, "activate"), ZeroDivisionError)
    assert run._node.state == FINALIZED
    run.run()
    assert run.code == 1


def test_errors_at_the_autostart_are_the_commands(run, folder):
    (folder / "LINE.BLK").write_text("10 COMMON NIL%\n20 CALL SCAN_LOOP(TICKS=1)\n30 END\n")
    with pytest.raises(RackError) as raised:
        run.autostart()
    assert raised.value.findings
    assert run._node.state == UNCONFIGURED


def test_a_signal_cuts_the_compilation_short(run, stop, monkeypatch):
    """It comes while tasks are compiled, which takes long for large racks."""
    from automax_ros.cli.run import live as live_session

    def compiled(*_, **__):
        stop.note(2)
        pytest.fail("the compilation goes on")

    monkeypatch.setattr(live_session, "Rack", compiled)
    run.autostart()
    assert run._node.state == UNCONFIGURED
    run.run()
    assert run.code == 0


def test_a_rack_of_another_name_is_refused(run, folder):
    file = folder / "rack.yaml"
    change(run, "configure")
    change(run, "cleanup")
    file.write_text(file.read_text().replace("rack: OPERATED", "rack: OTHER"))
    other = load(file).config
    run._managed = run._managed.__class__("operated", lambda: RunPlan(other, None, None, RecordingOptions(), (), ()))
    assert "start the program again" in str(change(run, "configure"))
    assert run._node.state == UNCONFIGURED
