"""Pieces done by the workers of a Dask cluster.

A scheduler executes the code that any client sends: keep it in a closed network, or use TLS (addresses ``tls://``;
certificates come from Dask's own configuration).

``client_of`` connects to a scheduler, or raises within a bounded time. ``attempt`` is executed by a worker: it does one
piece, if it may.
"""

from __future__ import annotations

import logging
import pickle
import queue
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent import futures
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from automax_ros.parallel.installation import Installation, installation
from automax_ros.parallel.job import MOST_TRIES, ClusterFault, Job, JobFault, JobResult, death_of, fault_of, result_of

_T = TypeVar("_T")
CONNECT_S = 10
"""How long a scheduler may take to respond, s (decision)."""
_MORE_S = 5
"""How much longer Dask may take to report that, s: with a server that is not a scheduler it would wait for ever."""
_BEGINNINGS = 3
"""How often a client is started (decision): Dask gives its thread 10 s to start, and raises a bare AssertionError."""
_INSTALL = "install it with `pip install 'automax_ros[cluster]'`"
_ADDRESS = "give the address that `dask scheduler` prints, such as tcp://10.0.0.1:8786"


_BEGUN, _ENDED = "begun", "ended"
WITHOUT_WORKERS_S = 300
"""How long a cluster may be without any worker, s (decision): some start workers only when there is work."""
SAME_S = 60
"""How long all workers together may take to report their installations, s (decision)."""
_POLL_S = 0.1
_LOOK_S = 2.0
_SAME = "install the same version on all machines, and start the workers again"
_SAME_MACHINE = "let all machines have the same Python, NumPy and C library, on processors of one kind"
_LOGGERS = ("distributed.client", "distributed.core", "distributed.comm", "distributed.batched", "distributed.utils")


def client_of(scheduler: str) -> Any:
    """Return a distributed.Client of a scheduler.

    Raises:
        ClusterFault: Dask is not installed; no scheduler responds; this machine is too busy to call it.
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
    """Return the result of a call to a cluster; some of Dask's own calls wait for ever.

    Raises:
        TimeoutError: there is no result within the time.
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
        client.status = "closed"  # else its deletion would wait for its end, and log that
        begun.set_exception(error)
    else:
        begun.set_result(client)


@dataclass(frozen=True)
class Refusal:
    """Why a worker has not started a piece: another installation, or a piece that was tried often enough."""

    worker: str
    installed: Installation
    deaths: tuple[str, ...] = ()


Answer = tuple[Any, JobFault | None]
"""The result of a piece, or its fault."""


def attempt(pickled: bytes, topic: str, wanted: Installation) -> Answer | Refusal:
    """Do a piece and return its outcome.

    The scheduler stores under ``topic`` which workers have started and which have finished: the others have died during
    the piece. A result that was lost with its worker, before it was fetched, does not count as such.
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


def _answer(piece: Job, worker: str) -> Answer:
    """Do a piece; a result that cannot be sent is its fault."""
    done = result_of(piece, worker)
    try:
        pickle.dumps(done.result)
    except Exception as error:
        return None, fault_of(piece.name, error, worker)
    return done.result, done.fault


def on_cluster(
    pieces: Sequence[Job], scheduler: str, take: Callable[[int, JobResult], None], should_stop: Callable[[], bool]
) -> None:
    """Do pieces by a cluster; the arguments and the end are those of ``run_jobs``.

    Dask itself restarts a piece whose worker is lost, and may do a piece twice; ``take`` gets the first result.

    Raises:
        ClusterFault: Dask is not installed; the scheduler cannot be reached, or is lost; a worker has another version.
    """
    with _connect(scheduler) as cluster:
        cluster.require_same()
        over: queue.SimpleQueue[int] = queue.SimpleQueue()
        futures = {number: cluster.submit(piece, number, over.put) for number, piece in enumerate(pieces)}
        try:
            while futures and not should_stop():
                try:
                    number = over.get(timeout=_POLL_S)
                except queue.Empty:
                    cluster.require_alive(_POLL_S)
                    continue
                result, fault = cluster.outcome(pieces[number], futures[number])
                del futures[number]  # so the cluster forgets it
                take(number, JobResult(pieces[number], result, fault))
        finally:
            cluster.give_up(list(futures.values()))


@contextmanager
def _connect(scheduler: str) -> Iterator[_Cluster]:
    """Connect to a scheduler while the block lasts; Dask's log messages are suppressed, our errors replace them."""
    loggers = [logging.getLogger(name) for name in _LOGGERS]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        client = client_of(scheduler)
        try:
            yield _Cluster(client, scheduler)
        finally:
            with suppress(Exception):
                client.close(timeout=2)
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


class _Cluster:
    """A cluster as one client sees it; ``client`` is a distributed.Client."""

    def __init__(self, client: Any, scheduler: str) -> None:
        self._client, self._scheduler = client, scheduler
        self._run = uuid.uuid4().hex
        self._own = installation()
        self._unlooked_s = _LOOK_S
        self._without_workers_s = 0.0

    def require_same(self) -> None:
        """Raise ClusterFault if a present worker has another installation than this machine, or does not respond."""
        try:
            answers = within(SAME_S, lambda: self._client.run(installation, on_error="return"))
        except TimeoutError:
            what = f"not every worker of the cluster reported within {SAME_S} s what is installed there"
            hint = "one hangs, or its machine does: end it; what is not there is not asked"
            raise ClusterFault("AMX6858", self._scheduler, what, hint) from None
        for worker, found in answers.items():
            if found != self._own:
                raise self._unlike(worker, found)

    def submit(self, piece: Job, number: int, over: Callable[[int], None]) -> Any:
        """Submit a piece to the cluster; return its future. ``over`` gets its number at the end, in another thread."""
        key = f"automax-{self._run}-{number}"
        future = self._client.submit(attempt, pickle.dumps(piece), key, self._own, key=key, pure=False)
        future.add_done_callback(lambda _: over(number))
        return future

    def outcome(self, piece: Job, future: Any) -> Answer:
        """Return the outcome of a piece that has ended.

        Raises:
            ClusterFault: the cluster is lost, or the worker has another installation.
        """
        try:
            found = future.result()
        except Exception as error:
            self.require_alive(_LOOK_S)
            return None, _fault(piece, error)
        if not isinstance(found, Refusal):
            outcome: Answer = found
            return outcome
        if found.installed != self._own:
            raise self._unlike(found.worker, found.installed)
        return None, death_of(piece.name, f"its workers have died ({', '.join(found.deaths)})")

    def require_alive(self, waited_s: float = 0.0) -> None:
        """Raise ClusterFault if there is no scheduler, or for long no worker; no result came for ``waited_s`` (s)."""
        self._unlooked_s += waited_s
        if self._unlooked_s < _LOOK_S and self._client.status == "running":
            return
        passed_s, self._unlooked_s = self._unlooked_s, 0.0
        try:
            workers = self._client.status == "running" and self._client.scheduler_info()["workers"]
        except Exception:
            workers = False
        if workers is False:
            hint = "see that it runs, and give the command again: nothing is kept of what was under way"
            raise ClusterFault("AMX6853", self._scheduler, "the Dask scheduler is lost", hint)
        self._without_workers_s = 0.0 if workers else self._without_workers_s + passed_s
        if self._without_workers_s > WITHOUT_WORKERS_S:
            what = f"the Dask scheduler has had no worker for {WITHOUT_WORKERS_S} s"
            raise ClusterFault("AMX6853", self._scheduler, what, f"start some: `dask worker {self._scheduler}`")

    def give_up(self, futures: list[Any]) -> None:
        if futures and self._client.status == "running":
            with suppress(Exception):
                self._client.cancel(futures, force=True)

    def _unlike(self, worker: str, found: object) -> ClusterFault:
        if not isinstance(found, Installation):
            what = f"worker {worker} cannot import automax_ros as it is here: {found}"
        elif (found.version, found.sources) != (self._own.version, self._own.sources):
            what = f"worker {worker} has automax_ros {found}, here is {self._own}"
        else:
            return ClusterFault("AMX6857", self._scheduler, _other_machine(worker, found, self._own), _SAME_MACHINE)
        return ClusterFault("AMX6854", self._scheduler, what, _SAME)


def _other_machine(worker: str, found: Installation, own: Installation) -> str:
    if found.python != own.python:
        return f"worker {worker} has {found.python}, here is {own.python}"
    if found.numpy != own.numpy:
        return f"worker {worker} has NumPy {found.numpy}, here is {own.numpy}"
    return (
        f"worker {worker} computes sine, exponential or the like with other last bits than this machine "
        f"(results {found.results[:12]}, here {own.results[:12]})"
    )


def _fault(piece: Job, error: Exception) -> JobFault:
    """Return the fault of a piece for which Dask returned an error instead of an outcome."""
    if type(error).__name__ == "KilledWorker":
        return death_of(piece.name, "its workers have died")
    return fault_of(piece.name, error)
