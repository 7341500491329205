"""Messages between the processes of a rack, there and back; and what a process knows of the others."""

from __future__ import annotations

import pytest

from automax_ros.core.kinds import WriteKind
from automax_ros.messages.bus.bus import (
    batch_of,
    image_message,
    image_of,
    stop_state_of,
    with_stop_state,
    write_message,
)
from automax_ros.messages.bus.peers import HUNG_NS, MISSING_NS, SILENCE_NS, Peers, PresenceVerdict
from automax_ros.messages.cdr.cdr import CdrError, decode, encode
from automax_ros.messages.types.messages import NAMES, BusImage, BusWrite, Presence, Stage, Values
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.distributed.image_sync import Batch, HeldForce, ImageCopy, StopState
from automax_ros.rack.distributed.versions import VersionedValue

TEXTS = frozenset({4})
BATCH = Batch(2, 9, 11_000_000, 5, WriteKind.COMMIT, ((0, 0, 7.0), (4, 1, "ABC"), (3, 2, 1.5), (4, 0, "")))
PICTURE = ImageCopy(
    9,
    (
        VersionedValue(0, 0, 7.0, 0xFFFF, (5, 1, 3)),
        VersionedValue(4, 1, "ABC", 0xFFFF, (6, 1, 4)),
        VersionedValue(8, 3, 0x88, 0x8008, (-1, 0, 0)),
    ),
    (HeldForce(0, 0, 7.0, True, (5, 1, 3)), HeldForce(1, 0, 0.0, False, (8, 2, 1))),
)
BEAT = 20_000_000


def there_and_back(message):
    return decode(NAMES[type(message)], encode(message))


def test_a_batch_comes_back_from_its_bytes():
    message = there_and_back(write_message(BATCH, 42, 77))
    assert (message.run_id, message.process) == (42, 77)
    assert batch_of(message, TEXTS) == BATCH


def test_an_image_comes_back_from_its_bytes():
    message = there_and_back(image_message(PICTURE, 5, 42, 77, 78))
    assert (message.asked_by, message.process) == (78, 77)
    assert image_of(message, TEXTS) == PICTURE


@pytest.mark.parametrize("cause", [None, StopCause(12, "bus error", "31", "SPEED"), StopCause(12, "by hand")])
def test_the_standing_comes_back_from_a_presence(cause):
    standing = StopState(12, 3, cause)
    presence = there_and_back(with_stop_state(said(), standing))
    assert stop_state_of(presence) == standing


def test_what_does_not_fit_together_is_not_a_message():
    write = write_message(BATCH, 42, 77)
    with pytest.raises(CdrError, match="kind"):
        batch_of(write._replace(kind=99), TEXTS)
    with pytest.raises(CdrError, match="length"):
        batch_of(BusWrite(1, 2, 3, 4, 5, 6, 1, Values((1, 2), (0,), (1.0,))), TEXTS)
    image = image_message(PICTURE, 5, 42, 77, 78)
    for field in ("mask", "since_ns", "seat", "order", "force_held", "force_order"):
        with pytest.raises(CdrError, match="length"):
            image_of(image._replace(**{field: getattr(image, field)[1:]}), TEXTS)
    assert image_of(BusImage(1, 2, 3, 4, 5), TEXTS) == ImageCopy(4, (), ())


def said(process=5, slot=2, *, run_id=42, state=Stage.RUNNING, fingerprint=1, sequence=0) -> Presence:
    return Presence(0, "PM1", run_id, process, slot, (slot,), fingerprint, int(state), 0, sequence)


def known(**lives) -> Peers:
    return Peers(1, 0, (0, 5), 1, 42, **lives)


def test_what_a_process_says_tells_whether_it_belongs_to_the_run():
    peers = known()
    assert peers.receive(said(1), 0) is PresenceVerdict.OWN
    assert peers.receive(said(), 0) is PresenceVerdict.NEW
    assert peers.receive(said(), 1) is PresenceVerdict.KNOWN
    assert peers.receive(said(6), 2) is PresenceVerdict.NEW
    assert peers.receive(said(9, 3, run_id=43), 2) is PresenceVerdict.OTHER_RUN
    assert peers.receive(said(9, 3, fingerprint=2), 2) is PresenceVerdict.OTHER_FILE
    assert peers.receive(said(9, 5), 2) is PresenceVerdict.SLOT_TAKEN
    assert [peer.process for peer in peers.running()] == [6]
    assert peers.of(6) is not None
    assert peers.of(9) is None


def test_a_process_without_a_run_joins_the_one_that_it_hears_of():
    peers = Peers(1, 0, (0,), 1)
    peers.receive(said(run_id=0), 0)
    assert peers.run_id == 0
    peers.receive(said(run_id=42)._replace(epoch_ns=1000), 0)
    assert (peers.run_id, peers.epoch_ns) == (42, 1000)


@pytest.mark.parametrize(("lives", "silence"), [(None, SILENCE_NS), (True, HUNG_NS)])
def test_a_silent_process_is_lost(lives, silence):
    peers = known(lives=lambda _: lives)
    peers.receive(said(), 0)
    lost_at = None
    for now in range(0, 2 * HUNG_NS, BEAT):
        gone = peers.look(now)
        if gone:
            lost_at = now
            break
    assert lost_at is not None
    assert silence < lost_at <= silence + BEAT
    assert peers.lost == {2}
    assert peers.receive(said(), lost_at + 1) is PresenceVerdict.NEW
    assert peers.lost == set()


def test_a_process_that_has_ended_is_lost_at_the_next_look():
    peers = known(lives=lambda _: False)
    peers.receive(said(), 0)
    assert [peer.process for peer in peers.look(1)] == [5]


def test_one_that_leaves_in_order_is_not_lost():
    peers = known(lives=lambda _: False)
    peers.receive(said(state=Stage.LEAVING), 0)
    assert peers.look(BEAT) == []
    assert peers.by_slot == {}
    assert peers.lost == set()


def test_who_was_held_up_itself_judges_nobody_before_it_has_listened():
    peers = known()
    peers.receive(said(), 0)
    assert peers.look(0) == []
    assert peers.look(10 * SILENCE_NS) == []
    peers.receive(said(), 10 * SILENCE_NS + 1)
    assert peers.look(10 * SILENCE_NS + BEAT) == []


def test_batches_that_did_not_come_are_noticed():
    peers = known()
    peers.receive(said(sequence=0), 0)
    peer = peers.of(5)
    assert peer is not None
    peer.got(1)
    peer.got(2)
    assert peers.owing() is None
    peer.got(4)
    assert peers.owing() is peer
    peer.caught_up(4)
    assert peers.owing() is None
    # It tells of batches that have not come: as long as they may wait here nothing is missing.
    for _ in range(100):
        word = said(sequence=6)
        peers.receive(word, 0)
        assert peers.is_short(word)
    assert peers.owing() is None
    # All was taken that had come: DDS has time to send them again.
    peers.missed(word, 0)
    peers.missed(word, MISSING_NS - 1)
    assert peers.owing() is None
    peer.got(5)
    assert peers.is_short(word)
    peers.missed(word, MISSING_NS)
    peers.missed(word, 2 * MISSING_NS - 1)
    assert peers.owing() is None
    peers.missed(word, 2 * MISSING_NS)
    assert peers.owing() is peer
    peer.caught_up(6)
    peers.missed(word, 4 * MISSING_NS)
    assert (peer.short_since_ns, peers.owing()) == (None, None)
    assert not peers.is_short(word)


def test_an_image_that_was_sent_before_a_batch_was_lost_does_not_bring_it():
    """It was on its way when batch 7 was lost, and arrives after batch 8."""
    peers = known()
    peers.receive(said(sequence=0), 0)
    peer = peers.of(5)
    assert peer is not None
    peer.got(1)
    peer.got(4)
    peer.got(5)
    peer.got(6)
    peer.got(8)
    assert peers.owing() is peer
    peer.caught_up(6)
    assert peers.owing() is peer
    peer.caught_up(7)
    assert peers.owing() is None


@pytest.mark.parametrize(
    "word", [said(run_id=43, sequence=9), said(fingerprint=2, sequence=9), said(9, 5, sequence=9), said(1, sequence=9)]
)
def test_what_a_word_says_that_was_not_accepted_is_not_missed(word):
    peers = known()
    peers.receive(said(sequence=0), 0)
    peers.receive(word, 0)
    assert not peers.is_short(word)
    for now_ns in range(0, 2 * MISSING_NS, BEAT):
        peers.missed(word, now_ns)
    assert peers.owing() is None
