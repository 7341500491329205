import os
import signal
import threading

import pytest

from automax_ros.compile.native.cache import NativeCache
from automax_ros.compile.native.forms import IN_PYTHON, WORTHWHILE_LINE_NS, WORTHWHILE_NS, NativeForms, NativeMode

from ..support import compiled_of
from .support import compiler_of
from .test_host import TASK


@pytest.fixture(scope="module")
def compiled():
    return compiled_of(TASK)


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
    lines = len(compiled.program.scan)
    enough = ((WORTHWHILE_NS + lines * WORTHWHILE_LINE_NS) // (75 * lines) + 1) * compiled.program.period_ns
    short = NativeForms(NativeMode.AUTO, enough // 2, cache).form(compiled)
    assert short.compiled is compiled
    assert short.why == "a run this short gains nothing by it (--native on)"
    assert NativeForms(NativeMode.AUTO, enough, cache).form(compiled).native is not None
    assert NativeForms(NativeMode.AUTO, None, cache).form(compiled).native is not None


def test_a_run_without_native_scans_says_why(compiled):
    forms = NativeForms(NativeMode.ON).off("a reason")
    assert forms.form(compiled).text == "TASK: in Python: a reason"
    assert IN_PYTHON.off("another") is IN_PYTHON


def test_ctrl_c_ends_the_compilers_too(compiled, monkeypatch, tmp_path):
    begun = tmp_path / "begun"
    os.mkfifo(begun)
    monkeypatch.setenv("CC", str(compiler_of(tmp_path, f"echo $$ > {begun}; exec sleep 1000")))
    started = []

    def interrupt():
        started.append(int(begun.read_text()))
        os.kill(os.getpid(), signal.SIGINT)

    other = threading.Thread(target=interrupt)
    other.start()
    with pytest.raises(KeyboardInterrupt):
        NativeForms(NativeMode.ON, cache=NativeCache(tmp_path / "cache")).made({"A": compiled})
    other.join()
    for thread in threading.enumerate():
        if thread.name.startswith("ThreadPoolExecutor"):
            thread.join()
    with pytest.raises(ProcessLookupError):
        os.kill(started[0], 0)
