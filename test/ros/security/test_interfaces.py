"""A policy has what a rack that runs really opens, as others in the graph see it, and what its recorder needs."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rack.helpers import config_at
from system.support import RACKS, ROOT, Automax, wait_until

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.processes import processes_of

LINE = ROOT / "config" / "two_racks" / "line" / "rack.yaml"
OPERATED = RACKS / "operated" / "rack.yaml"
ASKED = {
    "publish": "get_publisher_names_and_types_by_node",
    "subscribe": "get_subscriber_names_and_types_by_node",
    "reply": "get_service_names_and_types_by_node",
    "request": "get_client_names_and_types_by_node",
}


def config_of(path):
    return config_at(path)


@pytest.mark.parametrize("path", [LINE, OPERATED], ids=lambda path: path.parent.name)
def test_it_is_what_strangers_see_of_a_rack_that_runs(client, path):
    from automax_ros.ros.live_rack import LiveRack
    from automax_ros.ros.security.profiles import enclave_of_rack

    config = config_of(path)
    live = LiveRack(Rack(config))
    try:
        live.start([])
        space = f"/{config.namespace}"

        def seen() -> dict[tuple[str, str], set[str]]:
            nodes = [name for name, own in client.node.get_node_names_and_namespaces() if own == space]
            return {
                (name, part): {found for found, _ in getattr(client.node, ask)(name, space)}
                for name in nodes
                for part, ask in ASKED.items()
            }

        policy = {
            (profile.node, part): set(getattr(profile, part))
            for profile in enclave_of_rack(config).profiles
            for part in ASKED
        }
        wait_until(lambda: seen() == policy)
    finally:
        live.close()


def test_a_recorder_needs_no_more_than_its_enclave_allows(client, tmp_path):
    from automax_ros.ros.live_rack import LiveRack
    from automax_ros.ros.security.profiles import enclave_of_rack, recorder_of

    config = config_of(LINE)
    allowed = recorder_of("/line1", [enclave_of_rack(config)])
    live = LiveRack(Rack(config))
    try:
        live.start([])
        with Automax("record", "LINE1", "--output", tmp_path / "out"):

            def asked(part: str) -> set[str]:
                return {found for found, _ in getattr(client.node, ASKED[part])("recorder", "/line1")}

            wait_until(
                lambda: "recorder" in client.node.get_node_names() and "/line1/common/DRAW" in asked("subscribe")
            )
            assert asked("subscribe") <= set(allowed.names("subscribe"))
            assert asked("publish") - {"/parameter_events"} == set()
            assert asked("request") == set()
    finally:
        live.close()


def test_processes_of_a_distributed_rack_have_enclaves_of_their_own(ros_domain_id):
    from automax_ros.ros.security.profiles import enclaves_of_processes, operator_of

    config = replace(config_of(LINE), namespace="plant/line1")
    enclaves = {item.path: item for item in enclaves_of_processes(config, processes_of(config))}
    assert list(enclaves) == ["/plant/line1/common_memory", "/plant/line1/processor_1", "/plant/line1/network_5"]
    network, processor = enclaves["/plant/line1/network_5"], enclaves["/plant/line1/processor_1"]
    assert "/plant/dcsnet/PAPER" in network.names("publish")
    assert "/plant/dcsnet/PAPER" not in processor.names("publish")
    assert "/plant/line1/scans" in processor.names("publish")
    assert "/plant/line1/scans" not in network.names("publish")
    for enclave in enclaves.values():
        assert {"/plant/line1/bus", "/plant/line1/bus/presence"} <= set(enclave.names("publish"))
        assert {"/plant/line1/bus", "/plant/line1/bus/presence"} <= set(enclave.names("subscribe"))
    assert not any("bus" in name for name in operator_of("/plant/line1", enclaves.values()).names("publish"))


def test_a_rack_with_an_error_has_no_policy(tmp_path):
    from automax_ros.rack.tasks.installation import RackError

    (tmp_path / "T.BLK").write_text("10 CALL NOTHING(A=1)\n20 END\n")
    (tmp_path / "rack.yaml").write_text("rack: A\nslots:\n  0: {module: 57C435, tasks: {T: {priority: 5}}}\n")
    from automax_ros.ros.security.profiles import enclave_of_rack

    with pytest.raises(RackError):
        enclave_of_rack(config_of(tmp_path / "rack.yaml"))
