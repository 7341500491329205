"""What a worker of a Dask cluster executes: one piece, if it may."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any

from automax_ros.pieces.installation import Installation, installation
from automax_ros.pieces.piece import MOST_TRIES, Piece, PieceFault, fault_of, result_of

_BEGUN, _ENDED = "begun", "ended"


@dataclass(frozen=True)
class Refusal:
    """Why a worker has not even begun: another installation, or a piece that was begun often enough."""

    worker: str
    installed: Installation
    deaths: tuple[str, ...] = ()


@dataclass(frozen=True)
class Answer:
    """What came of a piece."""

    result: Any | None
    fault: PieceFault | None


def attempt(pickled: bytes, topic: str, wanted: Installation) -> Answer | Refusal:
    """Do a piece and return what came of it.

    The scheduler keeps under ``topic`` which workers have begun and which have come to an end: the others have died
    under the piece. A result that was lost with a worker, before it was fetched, does not count as such.
    """
    from distributed import get_client, get_worker

    worker, own = str(get_worker().address), installation()
    if own != wanted:
        return Refusal(worker, own)
    client = get_client()
    events = [event for _, event in client.get_events(topic)]
    ended = [name for what, name in events if what == _ENDED]
    died = tuple(name for what, name in events if what == _BEGUN and name not in ended)
    if len(died) >= MOST_TRIES:
        return Refusal(worker, own, died)
    client.log_event(topic, (_BEGUN, worker))
    answer = _answer(pickle.loads(pickled), worker)
    client.log_event(topic, (_ENDED, worker))
    return answer


def _answer(piece: Piece, worker: str) -> Answer:
    """Do a piece; a result that cannot be sent is its fault."""
    done = result_of(piece, worker)
    try:
        pickle.dumps(done.result)
    except Exception as error:
        return Answer(None, fault_of(piece.name, error, worker))
    return Answer(done.result, done.fault)
