import ctypes
import os
import signal
import threading

import pytest
from waiting import has_ended, wait_until

from automax_ros.compile.base.native_source import NOT_KEPT
from automax_ros.compile.native.run import task as task_module
from automax_ros.compile.native.run.build import build, find_compiler
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.forms import (
    IN_PYTHON,
    WORTHWHILE_KEPT_LINE_NS,
    WORTHWHILE_KEPT_NS,
    WORTHWHILE_LINE_NS,
    WORTHWHILE_NS,
    NativeForms,
    NativeMode,
)
from automax_ros.compile.native.run.task import native_form
from compile.base.test_host import TASK
from compile.native.support import begun_compiler_of, compiler_of
from compile.support import compiled_of


@pytest.fixture(scope="module")
def compiled():
    return compiled_of(TASK)


def _task_time_ns(compiled, python_ns):
    """Return the task time in which scans take this time in Python, as it is estimated."""
    return -(-python_ns // (75 * len(compiled.program.scan))) * compiled.program.period_ns


def _enough_for_a_kept_form(compiled):
    return _task_time_ns(compiled, WORTHWHILE_KEPT_NS + len(compiled.program.scan) * WORTHWHILE_KEPT_LINE_NS)


def test_off_gives_back_the_same_task(compiled):
    outcome = IN_PYTHON.made({"A": compiled})["A"]
    assert outcome.compiled is compiled
    assert (outcome.native, outcome.text) == (None, "TASK: in Python: native scans are off")
    assert IN_PYTHON.form(compiled) == outcome


def test_on_makes_tasks_native_by_their_names(compiled, tmp_path):
    made = NativeForms(NativeMode.ON, cache=NativeCache(tmp_path / "cache")).made({"A": compiled, "B": compiled})
    assert list(made) == ["A", "B"]
    assert [outcome.text for outcome in made.values()] == ["TASK: native"] * 2
    assert made["A"].compiled.scans is made["A"].native.scans
    assert made["A"].compiled.scans_forced is made["A"].native.scans_forced


def test_auto_builds_what_pays(compiled, tmp_path):
    cache = NativeCache(tmp_path / "cache")
    enough = _task_time_ns(compiled, WORTHWHILE_NS + len(compiled.program.scan) * WORTHWHILE_LINE_NS)
    short = NativeForms(NativeMode.AUTO, enough - compiled.program.period_ns, cache).form(compiled)
    assert short.compiled is compiled
    assert short.why == NOT_KEPT
    assert NativeForms(NativeMode.AUTO, enough, cache).form(compiled).native is not None
    assert NativeForms(NativeMode.AUTO, None, cache).form(compiled).native is not None


def test_auto_takes_what_another_run_has_built_for_a_shorter_one(compiled, tmp_path):
    cache = NativeCache(tmp_path / "cache")
    enough = _enough_for_a_kept_form(compiled)
    assert NativeForms(NativeMode.AUTO, enough, cache).form(compiled).text == f"TASK: in Python: {NOT_KEPT}"
    assert not list((tmp_path / "cache").iterdir())
    native_form(compiled, cache)
    assert NativeForms(NativeMode.AUTO, enough, cache).form(compiled).native is not None
    shorter = NativeForms(NativeMode.AUTO, enough - compiled.program.period_ns, cache).form(compiled)
    assert shorter.why == "a run this short gains nothing by it (--native on)"


@pytest.mark.parametrize("suffix", [".so", ".text"])
def test_a_kept_form_of_which_a_part_is_missing_is_not_built_for_a_short_run(compiled, tmp_path, suffix):
    cache = NativeCache(tmp_path / "cache")
    native_form(compiled, cache)
    for path in (tmp_path / "cache").glob(f"*{suffix}"):
        path.unlink()
    short = NativeForms(NativeMode.AUTO, _enough_for_a_kept_form(compiled), cache)
    assert short.form(compiled).why == NOT_KEPT
    assert not list((tmp_path / "cache").glob(f"*{suffix}"))


def test_what_helps_besides_tasks_is_built_where_it_pays(tmp_path, monkeypatch):
    text, cache = "int helps(void) { return 7; }", NativeCache(tmp_path / "cache")
    assert IN_PYTHON.library(text, 0) is None
    assert NativeForms(NativeMode.AUTO, 999, cache).library(text, 1000) is None
    assert not (tmp_path / "cache").exists()
    made = NativeForms(NativeMode.AUTO, 1000, cache).library(text, 1000)
    assert ctypes.CDLL(str(made)).helps() == 7
    assert NativeForms(NativeMode.AUTO, None, cache).library(text, 1000) == made
    assert NativeForms(NativeMode.ON, 0, cache).library(text, 1000) == made
    assert NativeForms(NativeMode.ON, 0, cache).library("no C", 1000) is None
    monkeypatch.setenv("CC", "nowhere-to-be-found")
    assert NativeForms(NativeMode.ON, 0, cache).library(text, 1000) is None


def test_a_run_without_native_scans_says_why(compiled):
    forms = NativeForms(NativeMode.ON).off("a reason")
    assert forms.form(compiled).text == "TASK: in Python: a reason"
    assert IN_PYTHON.off("another") is IN_PYTHON


def test_ctrl_c_ends_the_compilers_too(compiled, monkeypatch, tmp_path):
    monkeypatch.setenv("CC", str(begun_compiler_of(tmp_path)))
    started = []

    def interrupt():
        started.append(int((tmp_path / "begun").read_text()))
        os.kill(os.getpid(), signal.SIGINT)

    other = threading.Thread(target=interrupt)
    other.start()
    with pytest.raises(KeyboardInterrupt):
        NativeForms(NativeMode.ON, cache=NativeCache(tmp_path / "cache")).made({"A": compiled})
    other.join()
    for thread in threading.enumerate():
        assert thread is threading.main_thread() or thread.daemon  # no thread keeps the program from its end
        if thread.name.endswith("(work)"):
            thread.join()
    wait_until(lambda: has_ended(started[0]))


def test_ctrl_c_amid_a_translation_waits_for_nothing_and_starts_no_compiler(compiled, monkeypatch, tmp_path):
    """A long task's translation takes seconds, which nobody waits for; no compiler is started after it."""
    ran, goes_on, over = tmp_path / "ran", threading.Event(), threading.Event()
    monkeypatch.setenv("CC", str(compiler_of(tmp_path, f"echo $$ >> {ran}; exec sleep 1000")))

    def translating(*_, **__):
        os.kill(os.getpid(), signal.SIGINT)
        goes_on.wait()
        try:
            return build("int x;", find_compiler())
        finally:
            over.set()

    monkeypatch.setattr("automax_ros.compile.native.run.task.native_form", translating)
    with pytest.raises(KeyboardInterrupt):
        NativeForms(NativeMode.ON, cache=NativeCache(tmp_path / "cache")).made({"A": compiled})
    goes_on.set()
    assert over.wait(60)
    if ran.exists():  # it was started, and ended at once
        wait_until(lambda: has_ended(int(ran.read_text())))


def test_an_end_asked_for_on_a_thread_is_raised(compiled, monkeypatch, tmp_path):
    def ends(*_, **__):
        raise SystemExit("the program is to end")

    monkeypatch.setattr("automax_ros.compile.native.run.task.native_form", ends)
    with pytest.raises(SystemExit, match="the program is to end"):
        NativeForms(NativeMode.ON, cache=NativeCache(tmp_path / "cache")).made({"A": compiled, "B": compiled})


@pytest.mark.parametrize("mode", [NativeMode.AUTO, NativeMode.ON])
def test_a_fault_of_the_translator_leaves_its_task_in_python_and_asks_for_a_report(
    compiled, monkeypatch, tmp_path, mode
):
    other = compiled_of(TASK.replace("SUMMER", "DIFFERENCE"))
    kept = task_module.kept_translation

    def fails(task, cache, *, builds):
        if task is compiled:
            raise RecursionError("x" * 1000)
        return kept(task, cache, builds=builds)

    monkeypatch.setattr(task_module, "kept_translation", fails)
    made = NativeForms(mode, cache=NativeCache(tmp_path / "cache")).made({"A": compiled, "B": other})
    assert made["A"].compiled is compiled
    assert made["A"].native is None
    told = "TASK: in Python: automax itself failed to make it native, please report this with the task's text: "
    assert made["A"].text.startswith(f"{told}RecursionError: xxx")
    assert len(made["A"].text) < 450
    assert made["B"].text == "TASK: native"
