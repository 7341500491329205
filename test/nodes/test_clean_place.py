"""A process that is started again keeps away from the shared memory of the one that was killed."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from xml.etree import ElementTree

import pytest

from automax_ros.nodes import clean_place as module
from automax_ros.nodes.clean_place import clean_place, in_clean_place, user_port

DOMAIN = 100
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"


@pytest.fixture
def shared(tmp_path, monkeypatch):
    """A folder for shared memory, and nothing in the environment or on the ports."""
    monkeypatch.setattr(module, "_SHARED", tmp_path)
    monkeypatch.setattr(module, "_is_free", lambda port: port not in taken)
    monkeypatch.delenv(PROFILES, raising=False)
    taken: set[int] = set()
    return tmp_path, taken


def leave(folder: Path, *places: int) -> None:
    for place in places:
        (folder / f"fastrtps_port{user_port(DOMAIN, place)}").touch()


def test_ports_are_those_of_the_standard():
    assert (user_port(0, 0), user_port(0, 3), user_port(2, 1)) == (7411, 7417, 7913)


def test_where_nothing_is_left_fast_dds_chooses_itself(shared):
    folder, taken = shared
    assert clean_place(DOMAIN) is None
    taken.add(user_port(DOMAIN, 0))
    leave(folder, 0, 3)
    assert clean_place(DOMAIN) is None, "the first lives, and Fast DDS takes the second"


def test_the_number_of_a_killed_process_is_passed_over(shared):
    folder, taken = shared
    leave(folder, 0, 1)
    assert clean_place(DOMAIN) == 2
    taken.add(user_port(DOMAIN, 2))
    leave(folder, 2)
    assert clean_place(DOMAIN) == 3


def test_where_all_are_left_fast_dds_chooses_itself(shared):
    folder, _ = shared
    leave(folder, *range(120))
    assert clean_place(DOMAIN) is None


def test_a_port_that_is_bound_is_not_free():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        port = other.getsockname()[1]
        assert not module._is_free(port)
    assert module._is_free(port)
    assert not module._is_free(70_000), "the last domains have fewer ports"


def test_fast_dds_is_told_by_a_file_that_is_removed(shared):
    leave(shared[0], 0)
    with in_clean_place(DOMAIN):
        name = os.environ[PROFILES]
        (number,) = (item.text for item in ElementTree.parse(name).iter() if item.tag.endswith("participantID"))
        assert number == "1"
    assert PROFILES not in os.environ
    assert not Path(name).exists()


def test_profiles_of_the_environment_are_left_alone(shared, monkeypatch):
    leave(shared[0], 0)
    monkeypatch.setenv(PROFILES, "plant.xml")
    with in_clean_place(DOMAIN):
        assert os.environ[PROFILES] == "plant.xml"
    assert os.environ[PROFILES] == "plant.xml"
