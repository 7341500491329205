"""What of a message between processes is refused: forged processes, slots, times and numbers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.bus.bus import AHEAD_NS, BusLimits, with_stop_state
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import BusImage, BusWrite, Presence, Values
from automax_ros.rack.distributed.image_sync import StopState

PROCESS_SLOTS = {1: (1, 7), 3: (3,)}
WALL_NS = 1_800_000_000 * NS_PER_S
LATEST_NS = 3600 * NS_PER_S + AHEAD_NS
TRUE = Presence(WALL_NS, "PM1", 42, 5, 1, (1, 7), 9, 2, WALL_NS - 3600 * NS_PER_S, 100, standing_ns=7, standing_seat=7)
WRITE = BusWrite(7, 42, 5, 1, 8, 3, 0, Values((0,), (0,), (1.0,)))
IMAGE = BusImage(
    7,
    42,
    5,
    8,
    6,
    mask=(1,),
    since_ns=(-1,),
    seat=(0,),
    order=(0,),
    force_since_ns=(5,),
    force_seat=(3,),
    force_order=(2,),
)
LIMITS = BusLimits(PROCESS_SLOTS)


def test_what_processes_say_is_taken():
    assert LIMITS.of_presence(TRUE, WALL_NS, LATEST_NS) == ""
    assert LIMITS.of_presence(TRUE._replace(epoch_ns=0, standing_ns=0, standing_seat=0), WALL_NS, LATEST_NS) == ""
    assert LIMITS.of_write(WRITE, LATEST_NS) == ""
    assert LIMITS.of_image(IMAGE, LATEST_NS) == ""


@pytest.mark.parametrize(
    "forged",
    [
        {"seat": 9},
        {"seat": 7},
        {"slots": (1,)},
        {"slots": (1, 7, 9)},
        {"standing_seat": 200},
        {"standing_ns": (1 << 63) - 1},
        {"standing_ns": -1},
        {"standing_ns": LATEST_NS + 1},
        {"epoch_ns": (1 << 63) - 1},
        {"epoch_ns": -1},
        {"epoch_ns": 1},
        {"state": 4},
        {"sequence": (1 << 64) - 1},
    ],
    ids=str,
)
def test_what_cannot_be_true_of_a_process_is_refused(forged):
    assert LIMITS.of_presence(TRUE._replace(**forged), WALL_NS, LATEST_NS)


@pytest.mark.parametrize(
    "forged", [{"seat": 7}, {"stamp": -1}, {"stamp": (1 << 63) - 1}, {"sequence": 1 << 63}], ids=str
)
def test_what_cannot_be_true_of_a_write_is_refused(forged):
    assert LIMITS.of_write(WRITE._replace(**forged), LATEST_NS)


@pytest.mark.parametrize(
    "forged",
    [
        {"since_ns": (LATEST_NS + 1,)},
        {"since_ns": (-2,)},
        {"seat": (200,)},
        {"order": (1 << 63,)},
        {"force_since_ns": ((1 << 63) - 1,)},
        {"force_seat": (2,)},
        {"force_order": (1 << 63,)},
        {"sequence": 1 << 63},
    ],
    ids=str,
)
def test_what_cannot_be_true_of_an_image_is_refused(forged):
    assert LIMITS.of_image(IMAGE._replace(**forged), LATEST_NS)


@given(
    st.integers(-(1 << 63), (1 << 63) - 1),
    st.integers(0, 255),
    st.integers(-(1 << 63), (1 << 63) - 1),
    st.integers(0, (1 << 64) - 1),
)
def test_after_whatever_is_taken_a_later_stop_can_be_told(standing_ns, seat, epoch_ns, sequence):
    presence = TRUE._replace(standing_ns=standing_ns, standing_seat=seat, epoch_ns=epoch_ns, sequence=sequence)
    if not LIMITS.of_presence(presence, WALL_NS, LATEST_NS):
        encode(with_stop_state(presence, StopState(standing_ns + 1, seat)))
