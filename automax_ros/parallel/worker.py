"""The program of a local worker process: does the pieces that it receives until the other end is closed."""

from __future__ import annotations

import os
import pickle
import select
import threading
from multiprocessing.connection import Connection

from automax_ros.parallel.job import fault_of, result_of


def work(end: Connection) -> None:
    """Do the pieces received from a connection; return when its other end is closed."""
    threading.Thread(target=_end_when_alone, args=(end.fileno(),), daemon=True).start()
    with end:
        while True:
            try:
                end.send_bytes(_answer(end.recv_bytes()))
            except (EOFError, OSError):
                return


def _answer(payload: bytes) -> bytes:
    """Do a pickled piece; return its result and its fault, pickled, or a fault if the result cannot be pickled."""
    piece = pickle.loads(payload)
    done = result_of(piece)
    try:
        return pickle.dumps((done.result, done.fault))
    except Exception as error:
        return pickle.dumps((None, fault_of(piece.name, error)))


def _end_when_alone(number: int) -> None:
    """End this process, whatever it is doing, when the process that sends pieces has ended, also by a signal."""
    alone = select.poll()
    alone.register(number, 0)  # nothing but the end of the other side
    alone.poll()
    os._exit(1)
