"""The web line may be stored at any instant, scans of Processors and UDC under way: it goes on bit for bit."""

from __future__ import annotations

import copy
from pathlib import Path

from rack.helpers import config_at

from automax_ros.rack.rack import Rack

CONFIG = Path(__file__).parents[2] / "config" / "web_line" / "rack.yaml"
MS = 1_000_000
AFTER_US = (40, 150, 290, 360, 470, 555, 810, 990)
"""Instants after whole milliseconds: tasks of all modules are due at some of these."""


def under_way(state: object) -> set[str]:
    """The tasks that have begun a scan and not ended it."""
    found = set()
    if isinstance(state, dict):
        for key, value in state.items():
            if isinstance(value, dict) and value.get("progress"):
                found.add(key)
            found |= under_way(value)
    return found


def test_the_web_line_goes_on_from_the_middle_of_scans():
    config = config_at(CONFIG)
    rack = Rack(config)
    rack.start([("ESTOP_OK@", True), ("WEB_OK@", True), ("SECT_READY@", True), ("UNW_READY@", True), ("LINE_SP%", 500)])
    rack.run(1.0)
    rack.write("START_PB@", value=True)
    met: set[str] = set()
    for number, after_us in enumerate(AFTER_US):
        rack.scheduler.run_until((1_023 + 33 * number) * MS + after_us * 1000)
        state = rack.state()
        met |= under_way({slot: dict(kept) for slot, kept in state.modules.items()})
        twin = Rack(config)
        twin.load(copy.deepcopy(state))
        assert twin.state() == state
        for one in (rack, twin):
            one.memory.keep_log()
            one.memory.drain()
            one.scheduler.run_until(state.now_ns + 20 * MS)
        assert [write[1:] for write in twin.memory.drain()] == [write[1:] for write in rack.memory.drain()]
        assert twin.state() == rack.state()
    assert {"WIND_A", "WIND_B"} < met, "a state between scans would prove nothing"
