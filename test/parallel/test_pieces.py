"""Pieces done in this process and by processes of this machine: order, faults, workers that die, ends of all kinds."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import PATIENCE_S, has_ended, wait_until

from automax_ros.parallel.job import MOST_TRIES, Job, Workers, usable_cores
from automax_ros.parallel.run import run_jobs
from parallel import works

ROOT = Path(__file__).parents[2]


def squares(count):
    return [Job(f"square {number}", works.squared, (number,)) for number in range(count)]


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_results_come_in_the_order_of_the_pieces_and_each_is_told_once(jobs):
    told = []
    done = run_jobs(squares(20), Workers(jobs), told.append)
    assert [item.result for item in done] == [number**2 for number in range(20)]
    assert [item.piece.name for item in done] == [f"square {number}" for number in range(20)]
    assert sorted(item.piece.name for item in told) == sorted(item.piece.name for item in done)
    assert all(item.fault is None for item in done)


def test_nothing_is_begun_where_there_is_nothing_to_do():
    assert run_jobs([], Workers(4)) == []
    assert run_jobs([], Workers(scheduler="tcp://nobody:1")) == []


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_is_the_fault_of_its_piece_alone(jobs):
    done = run_jobs([Job(f"1/{n}", works.divided, (n,)) for n in (2, 0, 4)], Workers(jobs))
    assert [item.result for item in done] == [0.5, None, 0.25]
    fault = done[1].fault
    assert fault is not None
    assert (fault.piece, fault.kind, fault.message) == ("1/0", "ZeroDivisionError", "division by zero")
    assert "works.py" in fault.trace
    assert str(fault) == "1/0: division by zero"


def test_two_jobs_are_two_other_processes():
    found = {item.result for item in run_jobs([Job(str(n), works.own_process, (n,)) for n in range(40)], Workers(2))}
    assert len(found) == 2
    assert os.getpid() not in found
    wait_until(lambda: all(map(has_ended, found)))


def test_one_job_is_this_process():
    (done,) = run_jobs([Job("here", works.own_process, (0,))], Workers(1))
    assert done.result == os.getpid()


def test_a_result_that_cannot_be_sent_is_a_fault_of_the_piece():
    done = run_jobs([Job("odd", works.unlike_any, (0,)), *squares(2)], Workers(2))
    assert done[0].fault is not None
    assert "pickle" in done[0].fault.message
    assert [item.result for item in done[1:]] == [0, 1]


def test_a_worker_that_dies_costs_its_piece_a_second_try_and_no_other_piece_anything(tmp_path):
    pieces = [Job(f"piece {n}", works.killed, (str(tmp_path), n, 1 if n == 3 else 0)) for n in range(8)]
    told = []
    done = run_jobs(pieces, Workers(2), told.append)
    assert [item.result for item in done] == list(range(8))
    assert len(told) == 8
    assert [len((tmp_path / str(n)).read_text().split()) for n in range(8)] == [1, 1, 1, 2, 1, 1, 1, 1]


def test_a_piece_that_kills_its_workers_is_named_and_not_tried_again(tmp_path):
    pieces = [Job(f"piece {n}", works.killed, (str(tmp_path), n, 99 if n in {0, 3} else 0)) for n in range(5)]
    done = run_jobs(pieces, Workers(2))
    assert [item.result for item in done] == [None, 1, 2, None, 4]
    for number in (0, 3):
        fault = done[number].fault
        assert fault is not None
        assert fault.died
        assert fault.piece == f"piece {number}"
        assert "signal 9" in fault.message
        assert len((tmp_path / str(number)).read_text().split()) == MOST_TRIES == 2


def test_what_is_under_way_is_given_up_when_it_shall_stop(tmp_path):
    pieces = [*squares(1), *(Job(f"long {n}", works.long, (str(tmp_path), n)) for n in range(3))]
    done = run_jobs(pieces, Workers(2), should_stop=lambda: len(list(tmp_path.iterdir())) == 2)
    assert [item.result for item in done] == [0]
    assert all(has_ended(int(file.read_text())) for file in tmp_path.iterdir())


def test_one_job_stops_between_two_pieces():
    told = []
    assert len(run_jobs(squares(9), Workers(1), told.append, lambda: len(told) == 4)) == 4


def test_an_error_of_the_one_who_is_told_ends_all(tmp_path):
    class Enough(Exception):
        pass

    def told(_):
        wait_until(lambda: (tmp_path / "7").exists() and (tmp_path / "7").read_text())
        raise Enough

    pieces = [Job("long", works.long, (str(tmp_path), 7)), *squares(3)]
    with pytest.raises(Enough):
        run_jobs(pieces, Workers(2), told)
    assert has_ended(int((tmp_path / "7").read_text()))


THREADS = {
    "alone": "",
    "thread": "import threading; threading.Thread(target=time.sleep, args=(600,), daemon=True).start()",
    "thread unknown to threading": "import _thread; _thread.start_new_thread(time.sleep, (600,))",
}
PROGRAM = """
import sys, time
sys.path.append(sys.argv[2])
from automax_ros.parallel.job import Job, Workers
from automax_ros.parallel.run import run_jobs
from parallel import works
{thread}
try:
    run_jobs([Job(str(n), works.long, (sys.argv[1], n)) for n in range(2)], Workers(2))
except KeyboardInterrupt:
    print("interrupted")
"""


def program(text, *arguments):
    return [sys.executable, "-c", text, *arguments, str(ROOT / "test")]


@pytest.mark.parametrize("thread", ["alone", "thread"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_worker_outlives_the_one_that_gives_it_pieces(tmp_path, number, thread):
    """Not even one that was killed; and a script without a guard of its own is not executed by its workers."""
    with subprocess.Popen(
        program(PROGRAM.format(thread=THREADS[thread]), str(tmp_path)),
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        wait_until(lambda: len([file for file in tmp_path.iterdir() if file.read_text()]) == 2)
        os.killpg(process.pid, number)
        output, errors = process.communicate(timeout=PATIENCE_S)
    assert errors == ""
    assert output == ("interrupted\n" if number == signal.SIGINT else "")
    wait_until(lambda: all(has_ended(int(file.read_text())) for file in tmp_path.iterdir()))


COPIED = """
import atexit, sys, time
sys.path.append(sys.argv[1])
from automax_ros.parallel.job import Job, Workers
from automax_ros.parallel.run import run_jobs
from parallel import works
works.marks.append(7)
{thread}
atexit.register(print, "at its end")
print("begun")
print([item.result for item in run_jobs([Job(str(n), works.marked, (n,)) for n in range(4)], Workers(2))])
"""


@pytest.mark.parametrize(("thread", "mark"), list(zip(THREADS, ("[7]", "[]", "[]"), strict=True)))
def test_workers_are_copies_only_where_no_other_thread_runs(thread, mark):
    """What the process itself does at its end, and has not printed yet, its copies do not."""
    command = program(COPIED.format(thread=THREADS[thread]))
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert done.stdout == f"begun\n[{', '.join([mark] * 4)}]\nat its end\n"
    assert done.stderr == ""


def test_no_module_is_taken_from_the_folder_in_which_a_worker_begins(tmp_path, monkeypatch):
    (tmp_path / "select.py").write_text("raise SystemExit(1)")
    (tmp_path / "pickle.py").write_text("raise SystemExit(1)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [item for item in sys.path if item] + [str(ROOT)])
    assert [item.result for item in run_jobs(squares(3), Workers(2))] == [0, 1, 4]


def test_jobs_are_at_least_one_and_by_default_as_many_as_cores():
    with pytest.raises(ValueError, match="0 jobs: at least 1"):
        Workers(0)
    assert Workers(None).processes == usable_cores() >= 1
    assert Workers().processes == 1
