"""What a client tells of racks that it cannot operate."""

from __future__ import annotations

import pytest

from automax_ros.core.ticks import NS_PER_MS


class Graph:
    """What is seen in the graph, look by look."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, racks: int, operators: int) -> None:
        from automax_ros.ros.clients.rack_client import RackClient

        monkeypatch.setattr(RackClient, "_racks", lambda _: racks)
        monkeypatch.setattr(RackClient, "_nodes", lambda _, name: {"operator": operators}.get(name, 1))


@pytest.mark.parametrize(
    ("racks", "operators", "reason"),
    [
        (2, 1, "2 racks are called /pm1"),
        (1, 2, "2 racks are called /pm1"),
        (1, 0, "rack /pm1 has no operator's services"),
        (0, 0, "no rack /pm1 is seen within 0.1 s"),
    ],
)
def test_a_rack_that_cannot_be_operated_is_named_with_the_reason(ros_domain_id, monkeypatch, racks, operators, reason):
    from automax_ros.ros.clients.rack_client import NotOperable, RackClient

    Graph(monkeypatch, racks, operators)
    with RackClient("/pm1") as client, pytest.raises(NotOperable) as refused:
        client.find(100 * NS_PER_MS)
    assert refused.value.message == reason
    assert refused.value.hint


def test_a_second_rack_of_the_name_that_is_seen_later_is_not_operated_either(ros_domain_id, monkeypatch):
    from automax_ros.ros.clients.rack_client import ALONE_NS, NotOperable, RackClient

    Graph(monkeypatch, 1, 1)
    looks = iter([1, 1, 1])
    monkeypatch.setattr(RackClient, "_racks", lambda _: next(looks, 2))
    with RackClient("/pm1") as client:
        with pytest.raises(NotOperable, match="2 racks are called /pm1"):
            client.find(100 * NS_PER_MS, ALONE_NS)
        looks = iter([1, 1, 1])
        client.find(100 * NS_PER_MS)  # who only reads does not wait


def test_a_service_that_does_not_answer_is_an_error_and_not_a_wait(ros_domain_id, monkeypatch):
    from std_srvs.srv import Trigger

    from automax_ros.ros.clients.rack_client import NotOperable, RackClient

    Graph(monkeypatch, 1, 1)
    with RackClient("/pm1") as client:
        client.find(0)
        with pytest.raises(NotOperable, match="rack /pm1 does not answer on stop_all"):
            client.call(Trigger, "stop_all", Trigger.Request(), 200 * NS_PER_MS)


def test_an_answer_that_cannot_be_read_is_an_error_and_no_traceback(ros_domain_id, monkeypatch):
    """A stranger may serve the operator's service; malformed bytes let rcl's own error leave the executor."""
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from std_srvs.srv import Trigger

    from automax_ros.ros.clients.rack_client import NotOperable, RackClient

    def malformed(*_, **__):
        raise rclpy_implementation.RCLError("Failed to take response from service")

    with RackClient("/pm1") as client:
        monkeypatch.setattr(client._executor, "spin_once", malformed)
        with pytest.raises(NotOperable, match="what rack /pm1 answers on stop_all cannot be read"):
            client.call(Trigger, "stop_all", Trigger.Request(), 60_000 * NS_PER_MS)
