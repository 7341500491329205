"""The processes of a distributed rack speak over UDP, and no farther than their range."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

import pytest

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.ros.setup.discovery import announce_soon, avoid_shared_memory, choose_range, range_text

RANGE, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"
PROFILES, TRANSPORTS = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS"
OTHERS = ("ROS_LOCALHOST_ONLY", "RMW_IMPLEMENTATION")


def surroundings(monkeypatch, **values: str) -> None:
    for name in (RANGE, PEERS, PROFILES, TRANSPORTS, *OTHERS):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    for name, value in values.items():
        monkeypatch.setenv(name, value)


def found() -> dict[str, str]:
    return {name: os.environ[name] for name in (RANGE, PEERS, PROFILES, TRANSPORTS) if name in os.environ}


def profile() -> dict[str, str]:
    """Return the texts of the profile that was chosen, by their elements."""
    root = ElementTree.fromstring(Path(os.environ[PROFILES]).read_text(encoding="utf-8").encode())
    return {item.tag.rpartition("}")[2]: (item.text or "").strip() for item in root.iter()}


def periods() -> dict[str, int]:
    """Return the periods of the profile that was chosen, ns."""
    found = {}
    for item in ElementTree.fromstring(Path(os.environ[PROFILES]).read_text(encoding="utf-8").encode()).iter():
        parts = {part.tag.rpartition("}")[2]: int(part.text or "0") for part in item if part.tag.endswith("sec")}
        if parts:
            found[item.tag.rpartition("}")[2]] = parts["sec"] * NS_PER_S + parts["nanosec"]
    return found


@pytest.mark.parametrize("avoided", [False, True])
def test_programs_that_begin_at_one_time_soon_announce_themselves_again(monkeypatch, avoided):
    surroundings(monkeypatch)
    choose_range("localhost")
    announce_soon()
    if avoided:
        avoid_shared_memory()
    assert periods()["leaseAnnouncement"] == 250 * NS_PER_MS
    assert range_text() == "this host"
    assert (PEERS in found()) == avoided


def test_on_one_host_only_the_loopback_is_used(monkeypatch):
    surroundings(monkeypatch)
    choose_range(None)
    avoid_shared_memory()
    assert range_text() == "this host"
    assert (os.environ[RANGE], os.environ[PEERS]) == ("SUBNET", "127.0.0.1")
    texts = profile()
    assert (texts["type"], texts["address"], texts["useBuiltinTransports"]) == ("UDPv4", "127.0.0.1", "false")
    before = found()
    avoid_shared_memory()
    assert found() == before


def test_on_the_subnet_all_networks_are_used(monkeypatch):
    surroundings(monkeypatch)
    choose_range("subnet")
    avoid_shared_memory()
    assert found() == {RANGE: "SUBNET", PROFILES: os.environ[PROFILES]}
    assert range_text() == "the whole subnet"
    texts = profile()
    assert (texts["type"], texts["useBuiltinTransports"]) == ("UDPv4", "false")
    assert "address" not in texts


@pytest.mark.parametrize("chosen", [None, "subnet"])
def test_what_udp_has_dropped_is_sent_again_soon(monkeypatch, chosen):
    surroundings(monkeypatch)
    choose_range(chosen)
    avoid_shared_memory()
    texts = profile()
    assert periods() == {"leaseAnnouncement": 250 * NS_PER_MS, "heartbeatPeriod": 100 * NS_PER_MS}
    assert int(texts["receiveBufferSize"]) == 4 << 20


@pytest.mark.parametrize(
    "given",
    [
        {RANGE: "LOCALHOST", PROFILES: "plant.xml"},
        {RANGE: "SUBNET", TRANSPORTS: "DEFAULT"},
        {RANGE: "LOCALHOST", PEERS: "10.0.0.5"},
        {RANGE: "LOCALHOST", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"},
        {"ROS_LOCALHOST_ONLY": "1"},
    ],
)
def test_what_the_environment_says_goes_first(monkeypatch, given):
    surroundings(monkeypatch, **given)
    before, told = found(), range_text()
    announce_soon()
    avoid_shared_memory()
    after = found()
    if PROFILES not in given and "RMW_IMPLEMENTATION" not in given:
        assert after.pop(PROFILES).endswith("announced_soon.xml")
    assert (after, range_text()) == (before, told)
