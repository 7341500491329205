"""Connects to a Dask scheduler, or says within a bounded time why not."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent import futures
from typing import Any, TypeVar

from automax_ros.pieces.faults import ClusterFault

_T = TypeVar("_T")
CONNECT_S = 10
"""How long a scheduler may take to answer, s (decision)."""
_MORE_S = 5
"""How much longer Dask may take to say that it does not: for a server that is none it would wait for ever."""
_BEGINNINGS = 3
"""How often a client is begun (decision): Dask gives its thread 10 s to begin, and fails by a bare AssertionError."""
_INSTALL = "install it with `pip install 'automax_ros[cluster]'`"
_ADDRESS = "give the address that `dask scheduler` prints, such as tcp://10.0.0.1:8786"


def client_of(scheduler: str) -> Any:
    """Return a distributed.Client of a scheduler.

    Raises:
        ClusterFault: Dask is not installed; no scheduler answers; this machine is too busy to ask.
    """
    try:
        from distributed import Client
    except ImportError as error:
        what = f"a cluster needs Dask, which is not installed here ({error})"
        raise ClusterFault("AMX6851", scheduler, what, _INSTALL) from error
    for _ in range(_BEGINNINGS):
        begun: futures.Future[Any] = futures.Future()
        threading.Thread(target=_begin, args=(Client, scheduler, begun), daemon=True).start()
        try:
            return begun.result(CONNECT_S + _MORE_S)
        except (futures.TimeoutError, OSError, ValueError, TypeError, ImportError, RuntimeError) as error:
            why = str(error) or f"nothing that is one does within {CONNECT_S} s"
            raise ClusterFault("AMX6852", scheduler, f"no Dask scheduler answers: {why}", _ADDRESS) from error
        except AssertionError:
            continue
    what = "the Dask scheduler was not asked: this machine is too busy for Dask to begin a thread within 10 s"
    raise ClusterFault("AMX6852", scheduler, what, "give the command again when less is going on here")


def within(seconds: float, ask: Callable[[], _T]) -> _T:
    """Return what a question to a cluster brings; of Dask's own questions some wait for ever.

    Raises:
        TimeoutError: there is no answer within the time.
    """
    answer: futures.Future[_T] = futures.Future()
    threading.Thread(target=_put_answer, args=(ask, answer), daemon=True).start()
    try:
        return answer.result(seconds)
    except futures.TimeoutError as error:
        raise TimeoutError from error


def _put_answer(ask: Callable[[], _T], answer: futures.Future[_T]) -> None:
    try:
        answer.set_result(ask())
    except BaseException as error:
        answer.set_exception(error)


def _begin(kind: Any, scheduler: str, begun: futures.Future[Any]) -> None:
    client = kind.__new__(kind)
    try:
        client.__init__(scheduler, timeout=CONNECT_S, set_as_default=False)
    except BaseException as error:
        client.status = "closed"  # else whoever deletes it would wait for its end, and be told of that
        begun.set_exception(error)
    else:
        begun.set_result(client)
