"""Pieces done by a Dask cluster: a real scheduler and real workers, which die, and are of another version."""

import gc
import platform
import re
import signal
import socket
import sys

import numpy as np
import pytest

pytest.importorskip("distributed", reason="needs automax_ros[cluster]")

import distributed

from automax_ros.parallel.job import ClusterFault, Job, Workers
from automax_ros.parallel.run import run_jobs
from parallel import works
from parallel.clusters import cluster


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory):
    with cluster(tmp_path_factory.mktemp("dask")) as found:
        yield found


def squares(count):
    return [Job(f"square {number}", works.squared, (number,)) for number in range(count)]


def test_results_are_those_of_one_job(two_workers):
    told = []
    done = run_jobs(squares(30), Workers(scheduler=two_workers.address), told.append)
    assert done == run_jobs(squares(30), Workers(1))
    assert len(told) == 30


def test_pieces_are_done_by_the_workers(two_workers):
    pieces = [Job(str(n), works.own_process, (n,)) for n in range(30)]
    found = {item.result for item in run_jobs(pieces, Workers(scheduler=two_workers.address))}
    assert found == {worker.pid for worker in two_workers.workers}


def test_an_error_names_the_piece_and_the_worker(two_workers):
    pieces = [Job(f"1/{n}", works.divided, (n,)) for n in (2, 0, 4)]
    done = run_jobs(pieces, Workers(scheduler=two_workers.address))
    assert [item.result for item in done] == [0.5, None, 0.25]
    fault = done[1].fault
    assert fault is not None
    assert (fault.piece, fault.kind, fault.message) == ("1/0", "ZeroDivisionError", "division by zero")
    assert fault.worker.startswith("tcp://127.0.0.1:")
    assert str(fault) == f"1/0: division by zero (on {fault.worker})"


def test_a_result_that_cannot_be_sent_is_a_fault_of_the_piece(two_workers):
    (done,) = run_jobs([Job("odd", works.unlike_any, (0,))], Workers(scheduler=two_workers.address))
    assert done.fault is not None
    assert "pickle" in done.fault.message


def test_what_is_under_way_is_given_up_when_it_shall_stop(two_workers):
    told = []
    pieces = [Job(f"slow {n}", works.slow, (n,)) for n in range(500)]
    done = run_jobs(pieces, Workers(scheduler=two_workers.address), told.append, lambda: len(told) >= 3)
    assert 3 <= len(done) == len(told) < 500
    assert run_jobs(squares(1), Workers(scheduler=two_workers.address))[0].result == 0


def test_workers_that_die_cost_a_second_try_and_the_piece_that_kills_them_is_named(tmp_path):
    """One piece kills its first worker, and is done by another; one kills each, and is given up after two."""
    with cluster(tmp_path, 4) as found:
        notes = tmp_path / "notes"
        notes.mkdir()
        times = {3: 1, 5: 99}
        pieces = [Job(f"piece {n}", works.killed, (str(notes), n, times.get(n, 0))) for n in range(8)]
        told = []
        done = run_jobs(pieces, Workers(scheduler=found.address), told.append)
        assert [item.result for item in done] == [0, 1, 2, 3, 4, None, 6, 7]
        assert len(told) == 8
        fault = done[5].fault
        assert fault is not None
        assert fault.died
        assert str(fault).startswith("piece 5: its workers have died (tcp://")
        assert len((notes / "5").read_text().split()) == 2
        assert len((notes / "3").read_text().split()) >= 2  # more where a result was lost with a worker
        assert sum(worker.poll() is None for worker in found.workers) == 1


def test_a_worker_killed_from_outside_costs_a_second_try(tmp_path):
    with cluster(tmp_path) as found:
        notes = tmp_path / "notes"
        notes.mkdir()

        def kill_once(item):
            if len(told) == 1:
                found.workers[0].send_signal(signal.SIGKILL)

        told = []
        pieces = [Job(f"slow {n}", works.noted, (str(notes), n)) for n in range(12)]
        done = run_jobs(pieces, Workers(scheduler=found.address), lambda item: (told.append(item), kill_once(item)))
        assert [item.result for item in done] == list(range(12))
        assert len(told) == 12
        assert found.workers[0].wait() == -signal.SIGKILL


OTHERS = {
    "version": (
        "import automax_ros; automax_ros.__version__ = '0.0.9'",
        r"has automax_ros 0\.0\.9 \(sources [0-9a-f]{12}\)",
        "the same version",
    ),
    "none": ("sys.modules['automax_ros'] = None", "cannot import automax_ros as it is here", "same version"),
    "python": (
        "import platform; platform.python_version = lambda: '3.99.1'",
        rf"has CPython 3\.99\.1, here is CPython {re.escape(platform.python_version())}\n",
        "the same Python",
    ),
    "numpy": (
        "import numpy; numpy.__version__ = '1.0.1'",
        rf"has NumPy 1\.0\.1, here is {re.escape(np.__version__)}\n",
        "the same Python, NumPy",
    ),
    "arithmetic": (
        "import math; sine = math.sin; math.sin = lambda x: math.nextafter(sine(x), 2.0) if x == 1.0 else sine(x)",
        r"with other last bits than this machine \(results [0-9a-f]{12}, here [0-9a-f]{12}\)",
        "C library",
    ),
}
"""What a worker has that is unlike ours: text of the error, and what it says to do."""


@pytest.mark.parametrize("other", OTHERS)
def test_a_worker_of_another_installation_is_refused(tmp_path, other):
    before, message, hint = OTHERS[other]
    with cluster(tmp_path, 0) as found:
        found.worker(before)
        with pytest.raises(ClusterFault, match=message) as caught:
            run_jobs(squares(3), Workers(scheduler=found.address))
    assert caught.value.code == ("AMX6854" if other in {"version", "none"} else "AMX6857")
    assert hint in str(caught.value.hint)


def test_a_worker_that_hangs_before_it_tells_what_it_has_is_not_waited_for_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr("automax_ros.parallel.cluster.SAME_S", 1)
    with cluster(tmp_path, 2) as found:
        found.workers[1].send_signal(signal.SIGSTOP)
        with pytest.raises(ClusterFault, match="not every worker of the cluster reported within 1 s") as caught:
            run_jobs(squares(3), Workers(scheduler=found.address))
    assert caught.value.code == "AMX6858"


def test_a_worker_of_another_version_is_refused_when_it_comes_late(tmp_path):
    with cluster(tmp_path) as found:
        late = []

        def more(_):
            if not late:
                late.append(found.worker("import automax_ros; automax_ros.__version__ = '0.0.9'"))

        pieces = [Job(f"slow {n}", works.slow, (n,)) for n in range(2000)]
        with pytest.raises(ClusterFault, match=r"has automax_ros 0\.0\.9"):
            run_jobs(pieces, Workers(scheduler=found.address), more)


def test_a_scheduler_that_is_lost_is_said_to_be(tmp_path):
    with cluster(tmp_path) as found:
        pieces = [Job(f"slow {n}", works.slow, (n,)) for n in range(2000)]
        with pytest.raises(ClusterFault, match="the Dask scheduler is lost") as caught:
            run_jobs(pieces, Workers(scheduler=found.address), lambda _: found.scheduler.kill())
        assert caught.value.code == "AMX6853"


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://x", "tls://127.0.0.1:1"])
def test_a_scheduler_that_does_not_answer_is_said_to_be(address, monkeypatch):
    monkeypatch.setattr("automax_ros.parallel.cluster.CONNECT_S", 1)
    with pytest.raises(ClusterFault, match="no Dask scheduler answers") as caught:
        run_jobs(squares(3), Workers(scheduler=address))
    assert caught.value.code == "AMX6852"
    assert caught.value.place == address


def test_a_server_that_is_no_scheduler_is_not_waited_for_for_ever(monkeypatch):
    monkeypatch.setattr("automax_ros.parallel.cluster.CONNECT_S", 1)
    monkeypatch.setattr("automax_ros.parallel.cluster._MORE_S", 1)
    with socket.create_server(("127.0.0.1", 0)) as server:  # which connects, and says nothing
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ClusterFault, match="answers: nothing that is one does within 1 s") as caught:
            run_jobs(squares(3), Workers(scheduler=address))
    assert caught.value.code == "AMX6852"


@pytest.mark.filterwarnings("error")
def test_a_client_that_could_not_begin_is_not_waited_for():
    with pytest.raises(ClusterFault, match="no Dask scheduler answers"):
        run_jobs(squares(3), Workers(scheduler="nonsense://x"))
    gc.collect()  # Dask would wait for it here, and fail


@pytest.mark.parametrize("often", [1, 99])
def test_a_machine_that_is_too_busy_for_dask_to_begin_gets_another_chance(two_workers, monkeypatch, often):
    """So Dask fails where its thread takes more than 10 s to begin."""
    begun = []

    class Late(distributed.Client):
        def __init__(self, *arguments, **named):
            begun.append(1)
            assert len(begun) > often
            super().__init__(*arguments, **named)

    monkeypatch.setattr(distributed, "Client", Late)
    if often == 1:
        assert run_jobs(squares(3), Workers(scheduler=two_workers.address)) == run_jobs(squares(3), Workers(1))
        return
    with pytest.raises(ClusterFault, match="this machine is too busy for Dask") as caught:
        run_jobs(squares(3), Workers(scheduler=two_workers.address))
    assert caught.value.code == "AMX6852"


def test_a_cluster_without_workers_is_waited_for_but_not_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr("automax_ros.parallel.cluster.WITHOUT_WORKERS_S", 1)
    with cluster(tmp_path, 0) as found, pytest.raises(ClusterFault, match="has had no worker for 1 s"):
        run_jobs(squares(3), Workers(scheduler=found.address))


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterFault, match=r"pip install 'automax_ros\[cluster\]'") as caught:
        run_jobs(squares(3), Workers(scheduler="tcp://127.0.0.1:1"))
    assert caught.value.code == "AMX6851"
