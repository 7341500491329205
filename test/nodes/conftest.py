"""What tests of live nodes share: a client in the graph."""

import pytest


@pytest.fixture
def client(ros_domain_id):
    from system.support import Client

    with Client() as made:
        yield made
