"""What tests of live nodes share: a client in the graph, a live rack, its services."""

import time

import pytest

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from ros.support import until


@pytest.fixture
def client(ros_domain_id):
    from system.support import Client

    with Client() as made:
        yield made


@pytest.fixture
def context(ros_domain_id):
    """Somebody else's context, which nothing of ours shuts down."""
    from rclpy.context import Context

    made = Context()
    made.init(args=[])
    yield made
    made.try_shutdown()


@pytest.fixture
def live(request, ros_domain_id, tmp_path):
    """The rack of a test file, live: of its CONFIG, a path, or of its RACK and SOURCES, texts."""
    from automax_ros.ros.live_rack import LiveRack

    config = getattr(request.module, "CONFIG", tmp_path / "rack.yaml")
    for name, text in getattr(request.module, "SOURCES", {}).items():
        (tmp_path / f"{name}.BLK").write_text(text)
    if hasattr(request.module, "RACK"):
        config.write_text(request.module.RACK)
    made = LiveRack(Rack(load(config).config, stopwatch=time.monotonic_ns))
    made.start([])
    yield made
    made.close()


@pytest.fixture
def ask(live, client):
    """Calls a service of the live rack, whose type is a class or the name of one of automax_msgs."""
    import automax_msgs.srv
    from std_srvs.srv import Trigger

    clients = {}

    def ask(service, kind=Trigger, **fields):
        kind = getattr(automax_msgs.srv, kind) if isinstance(kind, str) else kind
        if service not in clients:
            clients[service] = client.node.create_client(kind, f"/{live.rack.config.namespace}/{service}")
            until(live, client, clients[service].service_is_ready)
        future = clients[service].call_async(kind.Request(**fields))
        until(live, client, future.done)
        return future.result()

    return ask
