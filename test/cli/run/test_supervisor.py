"""Processes that are kept running: told lines, ends in order, deaths and restarts, a watcher that is gone."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from waiting import PATIENCE_S, has_ended, wait_until

from automax_ros.cli.run.process_messages import ProcessOutput, Reported, TextLine, parse_message, send_report
from automax_ros.cli.run.status import Progress, Summary, merged_progress, merged_summary
from automax_ros.cli.run.supervisor import BACKOFFS_NS, STAGE_NS, WINDOW_NS, ProcessSpec, Restarts, Supervisor
from automax_ros.core.ticks import NS_PER_S

REPORT = 'print(json.dumps({"report": {"ok": True}}), flush=True)'
BEGINS = 'print(json.dumps({"progress": {"now_ns": 1}}), flush=True)\n'
WAITS = """
stop = StopRequest()
end_with_watcher(stop)
def note(number, _):
    stop.requested = True
signal.signal(signal.SIGTERM, note)
print("up", flush=True)
while not stop.requested:
    time.sleep(0.005)
print("down", flush=True)
"""


def program(text: str) -> list[str]:
    head = "import json, os, signal, sys, time\nfrom automax_ros.cli.run.child_process import end_with_watcher\n"
    return [sys.executable, "-c", head + "from automax_ros.cli.output.signals import StopRequest\n" + text]


class Heard:
    """What a supervisor's listener is told."""

    def __init__(self) -> None:
        self.said: list[tuple[str, str]] = []
        self.reports: list[str] = []
        self.errors: list[tuple[str, str]] = []
        self.deaths: list[tuple[str, str, float | None]] = []

    def heard(self, name, told):
        if isinstance(told, TextLine):
            self.said.append((name, told.text))
        elif isinstance(told, Reported):
            self.reports.append(name)

    def complained(self, name, line):
        self.errors.append((name, line))

    def died(self, name, how, again_s):
        self.deaths.append((name, how, again_s))

    def until(self, condition):
        deadline = time.monotonic() + PATIENCE_S
        while not condition(self):
            assert time.monotonic() < deadline, (self.said, self.errors, self.deaths)
            time.sleep(0.005)


class Supervised:
    """A supervisor that runs on a thread, to be asked to stop."""

    def __init__(self, *posts: ProcessSpec, restart: bool = True) -> None:
        self.heard, self._stop = Heard(), threading.Event()
        self.supervisor = Supervisor(posts, self.heard.heard, self.heard.complained, self.heard.died, restart=restart)
        self._thread = threading.Thread(target=self.supervisor.run, args=(self._stop.is_set,))

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        self._stop.set()
        self.ended()

    def ended(self):
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()


def test_processes_that_report_have_ended_in_order():
    posts = [
        ProcessSpec("home", program(REPORT), stage=1, ends_run=True),
        ProcessSpec("one", program("print('hi')\n" + REPORT)),
    ]
    with Supervised(*posts) as run:
        run.ended()
    assert run.supervisor.codes == {"home": 0, "one": 0}
    assert run.supervisor.deaths == {}
    assert run.heard.said == [("one", "hi")]
    assert sorted(run.heard.reports) == ["home", "one"]


def test_all_end_in_order_the_lowest_stage_first():
    posts = [
        ProcessSpec(name, program(WAITS + REPORT), stage=stage) for name, stage in (("home", 1), ("one", 0), ("two", 0))
    ]
    with Supervised(*posts, ProcessSpec("recorder", program(WAITS), stage=2, reports=False)) as run:
        run.heard.until(lambda heard: sum(text == "up" for _, text in heard.said) == 4)
        run.stop()
    down = [name for name, text in run.heard.said if text == "down"]
    assert sorted(down[:2]) == ["one", "two"]
    assert down[2:] == ["home", "recorder"]
    assert run.supervisor.codes == dict.fromkeys(("home", "one", "two", "recorder"), 0)


def test_a_recorder_is_not_asked_to_end_before_a_process_that_takes_its_time():
    """Its last messages come after more time than another stage is given."""
    late = WAITS.replace('print("down"', f'time.sleep({STAGE_NS / NS_PER_S + 0.5})\nprint("down"')
    recorder = ProcessSpec("recorder", program(WAITS), stage=2, reports=False, after_ns=600 * NS_PER_S)
    with Supervised(ProcessSpec("home", program(late + REPORT), stage=1), recorder) as run:
        run.heard.until(lambda heard: sum(text == "up" for _, text in heard.said) == 2)
        run.stop()
    assert [name for name, text in run.heard.said if text == "down"] == ["home", "recorder"]


def test_a_process_that_was_killed_is_started_again_and_the_others_are_left_alone():
    posts = [ProcessSpec(name, program(WAITS + REPORT)) for name in ("one", "two")]
    with Supervised(*posts) as run:
        run.heard.until(lambda heard: len(heard.said) == 2)
        before = run.supervisor.pids
        os.kill(before["one"], signal.SIGKILL)
        run.heard.until(lambda heard: heard.said.count(("one", "up")) == 2)
        after = run.supervisor.pids
        run.stop()
    assert after["two"] == before["two"]
    assert after["one"] != before["one"]
    ((name, how, again_s),) = run.heard.deaths
    assert (name, how) == ("one", "was ended by SIGKILL")
    assert again_s == pytest.approx(BACKOFFS_NS[0] / 1e9, abs=0.1)
    assert run.supervisor.deaths == {"one": 1}
    assert run.supervisor.codes == {"one": 0, "two": 0}


def test_a_process_that_dies_three_times_is_given_up():
    with Supervised(
        ProcessSpec("one", program(BEGINS + "sys.exit(7)")), ProcessSpec("two", program(WAITS + REPORT))
    ) as run:
        run.heard.until(lambda heard: len(heard.deaths) == 3)
        run.stop()
    assert [again_s is None for _, _, again_s in run.heard.deaths] == [False, False, True]
    assert run.heard.deaths[0][1] == "ended with exit code 7"
    assert run.supervisor.codes == {"one": 7, "two": 0}


def test_without_restarts_a_death_is_told_and_the_home_ends_the_run():
    with Supervised(
        ProcessSpec("home", program(BEGINS + "sys.exit(1)"), ends_run=True),
        ProcessSpec("one", program(WAITS + REPORT)),
        restart=False,
    ) as run:
        run.ended()
    assert run.heard.deaths == [("home", "ended with exit code 1", None)]
    assert run.supervisor.codes == {"home": 1, "one": 0}


@pytest.mark.parametrize("code", [1, 2])
def test_what_cannot_begin_ends_the_run_at_once(code):
    refuses = f"print('no', file=sys.stderr)\nsys.exit({code})"
    with Supervised(ProcessSpec("one", program(refuses)), ProcessSpec("two", program(WAITS + REPORT))) as run:
        run.ended()
    assert run.heard.errors == [("one", "no")]
    assert run.heard.deaths == []
    assert run.supervisor.codes == {"one": code, "two": 0}


def test_a_process_asked_to_end_before_it_heeds_signals_has_ended_well():
    with Supervised(ProcessSpec("one", program("print('up', flush=True)\ntime.sleep(60)"))) as run:
        run.heard.until(lambda heard: bool(heard.said))
        run.stop()
    assert run.supervisor.codes == {"one": 0}


def test_children_end_with_a_watcher_that_is_killed(tmp_path):
    """SIGKILL lets nobody clean up: the children notice by themselves."""
    watcher = (
        f"from automax_ros.cli.run.supervisor import ProcessSpec, Supervisor\nchild = {program(WAITS)!r}\n"
        "def show(name, told): print(name, told.text, supervisor.pids[name], flush=True)\n"
        "specs = [ProcessSpec('one', child), ProcessSpec('two', child)]\n"
        "supervisor = Supervisor(specs, show, print, print)\n"
        "supervisor.run(lambda: False)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", watcher], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    pids = [int(process.stdout.readline().split()[2]) for _ in range(2)]
    process.kill()
    process.wait()
    process.stdout.close()
    wait_until(lambda: all(map(has_ended, pids)))


def test_deaths_count_together_for_ten_seconds():
    restarts = Restarts()
    assert restarts.died(0) == BACKOFFS_NS[0]
    assert restarts.died(WINDOW_NS // 2) == WINDOW_NS // 2 + BACKOFFS_NS[1]
    assert restarts.died(WINDOW_NS) == WINDOW_NS + BACKOFFS_NS[1]
    assert restarts.died(WINDOW_NS + 1) is None
    assert (restarts.count, restarts.given_up) == (4, True)


def test_what_a_process_tells_is_heard_alike(capsys):
    screen = ProcessOutput()
    progress = Progress(5, ("STOP",), 2.5, ("P1 3 % late 0",), None, {"fault": 2}, ("A%=1",))
    summary = Summary(1.5, True, ("row",), ("note",), ("A%=1",))
    screen.progress(progress)
    screen.summary(summary)
    screen.message("a line")
    send_report({"rack": "PM1"})
    lines = capsys.readouterr().out.splitlines()
    assert [parse_message(line) for line in lines] == [progress, summary, TextLine("a line"), Reported({"rack": "PM1"})]


@pytest.mark.parametrize(
    "line", ["", "text", "[1]", '{"a": 1}', '{"progress": 1}', '{"progress": {"x": 1}}', "[" * 9999]
)
def test_other_lines_are_said_as_they_are(line):
    assert parse_message(line) == TextLine(line)


def test_parts_of_a_rack_are_told_as_one():
    home = Progress(1_000_000_000, (), 0.0, (), None, {"fault": 1}, ("A%=1",))
    one = Progress(990_000_000, ("STOP",), 100.0, ("P1 3 % late 0",), None, {"fault": 2})
    two = Progress(980_000_000, ("STOP",), 90.5, ("P2 4 % late 1",), None, {"loss": 1}, ("B%=2",))
    assert merged_progress([home, one, two]).parts == [
        "     1.0 s", "STOP", "190 scans/s", "P1 3 % late 0", "P2 4 % late 1", "3 faults", "1 loss", "A%=1"
    ]  # fmt: skip
    lines = merged_summary([Summary(2.0, True, (), ("n",), ("A%=1",)), Summary(1.9, True, ("r",), ("m",))]).lines
    assert lines[0] == "ran 2.000 s"
    assert lines[2:] == ["r", "n", "m", "  A%=1"]


def test_json_of_a_report_is_one_line(capsys):
    send_report({"text": "a\nb"})
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line) == {"report": {"text": "a\nb"}}


def test_a_run_that_cannot_begin_without_a_process_ends_with_it():
    posts = [ProcessSpec("home", program(WAITS + REPORT), ends_run=True)]
    with Supervised(*posts, ProcessSpec("recorder", program("sys.exit(2)"), reports=False, begins_run=True)) as run:
        run.ended()
    assert run.supervisor.codes["recorder"] == 2


def test_a_process_that_does_not_end_is_killed_and_named(monkeypatch):
    monkeypatch.setattr("automax_ros.cli.run.supervisor.END_NS", NS_PER_S)
    deaf = "signal.signal(signal.SIGTERM, signal.SIG_IGN)\nprint('up', flush=True)\ntime.sleep(600)"
    with Supervised(ProcessSpec("deaf", program(deaf)), ProcessSpec("one", program(WAITS + REPORT))) as run:
        run.heard.until(lambda heard: len(heard.said) == 2)
        run.stop()
    assert run.heard.errors == [("deaf", "still runs 1.8 s after the run was asked to end: it is killed")]
    assert run.supervisor.codes == {"deaf": -signal.SIGKILL, "one": 0}
