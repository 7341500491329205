"""`automax run --no-autostart` under a lifecycle manager, over real DDS."""

import re
import shutil
import signal

import pytest
from ros.managing import ACTIVE, INACTIVE, UNCONFIGURED, Manager

from automax_ros.recordings.read.reader import BagReader
from system.support import RACKS, ROOT, TYPES, Automax, Client, automax_here

WAITS = "is unconfigured"
OPERATED = RACKS / "operated" / "rack.yaml"


@pytest.fixture
def rack(tmp_path):
    """A copy of a rack that may be broken and mended."""
    folder = tmp_path / "rack"
    shutil.copytree(RACKS / "operated", folder)
    return folder / "rack.yaml"


def manager_of(client, space="/operated"):
    return Manager(client, space, client.until)


def test_a_manager_brings_a_rack_up_and_down_again(ros_domain_id, rack, tmp_path):
    """Errors in the file and in a task fail the transition with what is wrong; mended, the rack runs twice."""
    from rcl_interfaces.msg import Log
    from std_msgs.msg import Int16

    text, bag = rack.read_text(), tmp_path / "bag"
    task = rack.with_name("LINE.BLK")
    source = task.read_text()
    rack.write_text(text.replace("tick_ms: 5.5", "tick_ms: 0.1"))
    with Automax("run", rack, "--no-autostart", "--record", bag) as process, Client() as client:
        process.wait_for_line(WAITS)
        logs = client.listen(Log, "/rosout")
        manager = manager_of(client)
        assert manager.state("rack") == UNCONFIGURED
        assert not manager.ask("rack", "activate")
        assert not manager.ask("rack", "configure")
        client.until(lambda: any("rack.yaml:" in item.msg and "error[" in item.msg for item in logs))
        rack.write_text(text)
        task.write_text(source.replace("COUNT! + 1", "NIL! + 1"))
        assert not manager.ask("rack", "configure")
        client.until(lambda: any("NIL!" in item.msg and "LINE.BLK:" in item.msg for item in logs))
        assert manager.state("rack") == UNCONFIGURED
        task.write_text(source)
        assert manager.ask("rack", "configure")
        assert manager.state("rack") == manager.state("processor_1") == INACTIVE
        assert not manager.ask("processor_1", "activate"), "the node rack comes first"
        out = client.listen(Int16, "/operated/common/OUT", latched=True, depth=1)
        assert manager.ask("rack", "activate")
        client.until(lambda: bool(out) and out[-1].data != 0, "the task's output")
        assert manager.state("processor_1") == ACTIVE
        assert manager.ask("rack", "deactivate")
        client.until(lambda: out[-1].data == 0, "an output that is off")
        assert manager.ask("rack", "activate")
        client.until(lambda: out[-1].data != 0, "the task's output, again")
        assert manager.ask("rack", "deactivate")
        assert manager.ask("rack", "cleanup")
        client.until(lambda: "processor_1" not in client.node.get_node_names())
        assert manager.ask("rack", "configure")
        assert manager.ask("rack", "activate")
        assert manager.ask("rack", "shutdown")
        ended = process.end()
    assert ended.code == 0
    assert re.search(r"rack.yaml:\d+:\d+: error\[AMX\d+\]: .*tick", ended.err)
    assert "LINE.BLK:" in ended.err
    assert "Traceback" not in ended.err
    for folder in (bag, bag.with_name("bag_2")):
        whats = [item.message.what for item in BagReader(folder).messages(topics={"/operated/operations"})]
        assert whats == (["stop_all", "run_all", "stop_all"] if folder == bag else [])


def test_the_page_shows_how_it_is_done_by_hand(ros_domain_id, tmp_path):
    """The commands of docs/ros.md, one after the other."""
    page = (ROOT / "docs" / "ros.md").read_text(encoding="utf-8")
    found = re.search(r"<!-- run by test/system/running/test_lifecycle.py -->\n```sh\n(.*?)```", page, re.DOTALL)
    assert found is not None
    file = tmp_path / "rack.yaml"
    file.write_text(OPERATED.read_text().replace("rack: OPERATED", "rack: PM1").replace(", critical: true", ""))
    for name in ("LINE.BLK", "SPEED.BLK"):
        shutil.copy(OPERATED.with_name(name), tmp_path)
    with Automax("run", file, "--no-autostart") as process:
        process.wait_for_line(WAITS)
        printed = []
        for command in found[1].splitlines():
            ended = automax_here(*command.split()[1:], "--timeout", "30")
            assert (ended.code, ended.err) == (0, ""), command
            printed.append(ended.out)
        assert printed == ["done\n", "done\n", "done\n", "inactive\n", "done\n"]
        assert process.end().code == 0


def test_without_an_operator_a_manager_may_start_a_rack_but_not_stop_it(ros_domain_id):
    with Automax("run", TYPES, "--no-autostart") as process, Client() as client:
        process.wait_for_line(WAITS)
        manager = manager_of(client, "/types")
        assert manager.ask("rack", "configure")
        assert manager.ask("rack", "cleanup")
        assert manager.ask("rack", "configure")
        assert manager.ask("rack", "activate")
        for transition in ("deactivate", "shutdown"):
            assert not manager.ask("rack", transition)
        assert manager.state("rack") == ACTIVE
        ended = process.end(signal.SIGTERM)
    assert (ended.code, ended.err) == (0, "")


def test_transitions_of_a_distributed_rack_reach_all_processes(ros_domain_id, tmp_path):
    from std_msgs.msg import Int32

    folder = tmp_path / "rack"
    shutil.copytree(TYPES.parent, folder)
    file = folder / "rack.yaml"
    file.write_text(file.read_text().replace("rack: TYPES", "rack: TYPES\noperator: true\non_module_loss: hold"))
    modules = ("processor_1", "processor_2")
    with Automax("run", file, "--distributed", "--no-restart") as process, Client() as client:
        process.wait_for_line("Ctrl-C ends the run")
        manager = manager_of(client, "/types")
        client.until(lambda: all(manager.state(node) == ACTIVE for node in ("rack", *modules)))
        counts = client.listen(Int32, "/types/common/COUNT", latched=True, depth=1)
        client.until(lambda: bool(counts) and counts[-1].data > 0, "a scan of processor_1")
        assert not manager.ask("rack", "cleanup")
        assert not manager.ask("rack", "shutdown"), "its processes are ended by who started them"
        assert manager.ask("rack", "deactivate")
        client.until(lambda: all(manager.state(node) == INACTIVE for node in ("rack", *modules)))
        stopped = counts[-1].data
        assert manager.ask("rack", "activate")
        client.until(lambda: all(manager.state(node) == ACTIVE for node in ("rack", *modules)))
        client.until(lambda: counts[-1].data > stopped + 1, "a scan of processor_1, again")


def test_a_fault_leaves_the_node_active(ros_domain_id):
    """A manager that finds a node inactive without having asked for it brings the system down."""
    from std_msgs.msg import Bool

    with Automax("run", RACKS / "stuck" / "rack.yaml") as process, Client() as client:
        process.wait_for_line("Ctrl-C ends the run")
        client.send(Bool, "/stuck/common/GO/set", Bool(data=True))
        process.wait_for_line("STOP ALL (code 14)")
        assert manager_of(client, "/stuck").state("rack") == ACTIVE
        assert process.end(signal.SIGINT).code == 1


def test_a_file_without_a_name_cannot_wait(ros_domain_id, tmp_path):
    (tmp_path / "rack.yaml").write_text("slots: {}\n")
    with Automax("run", tmp_path / "rack.yaml", "--no-autostart") as process:
        ended = process.end()
    assert ended.code == 2
    assert "has no rack name (`rack:`)" in ended.err
