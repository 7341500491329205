"""What tests of live nodes share: a client in the graph."""

import pytest


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
