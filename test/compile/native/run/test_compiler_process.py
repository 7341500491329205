import contextlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run import compiler_process
from automax_ros.compile.native.run.build import build, find_compiler
from automax_ros.compile.native.run.cache import STALE_S
from automax_ros.compile.native.run.compiler_process import FOLDER, abandon, memory_of, run_compiler
from compile.native.support import PATIENCE_S, await_that, begun_compiler_of, compiler_of, has_ended

NEEDS_GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")


FILE_BLOCKS = (256 << 20) // 512


def doubled(times: int) -> str:
    """A C text of few characters in which a compiler finds two to this power of them."""
    macros = "".join(f"#define M{n + 1} M{n}+M{n}\n" for n in range(times))
    return f"#define M0 x\n{macros}int f(int x) {{ return M{times}; }}\n"


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The folder in which those of compilers are made, which holds nothing else."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


@pytest.fixture(params=["sh", "bash", "dash"])
def shell(request, monkeypatch):
    """Each shell that may stand under the name of ``sh``."""
    path = shutil.which(request.param)
    if path is None:
        pytest.skip(f"there is no {request.param}")
    monkeypatch.setattr(compiler_process, "_SHELL", path)


@pytest.mark.usefixtures("shell")
def test_a_compiler_and_what_it_starts_may_have_so_much_and_no_more(tmp_path, temporary):
    told = tmp_path / "told"
    limits = "ulimit -v; ulimit -t; ulimit -c; ulimit -f"
    path = compiler_of(tmp_path, f"{{ {limits}; sh -c '{limits}'; pwd; cat; }} > {told}")
    text = "int x;\n" * 1000
    assert run_compiler([str(path)], os.environ["PATH"], text, 20.0).library is None
    *numbers, folder, read = told.read_text().split("\n", 9)
    blocks = [int(numbers.pop(place)) for place in (7, 3)]
    assert blocks in ([FILE_BLOCKS] * 2, [2 * FILE_BLOCKS] * 2)  # bash by this name counts blocks of 1024 bytes
    assert numbers == [str(memory_of(text) >> 10), "21", "0"] * 2
    assert folder.startswith(str(temporary / FOLDER))
    assert read == text
    assert list(temporary.iterdir()) == []


def test_memory_goes_with_the_length_of_the_text_up_to_half_of_the_machine(monkeypatch, tmp_path):
    container = tmp_path / "memory.max"
    monkeypatch.setattr(compiler_process, "_CONTAINER_LIMIT", container)
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY,) * 2)
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": (64 << 30) // 4096}
    monkeypatch.setattr(os, "sysconf", pages.__getitem__)
    assert memory_of("") == 1 << 30
    # What gcc 12 was seen to take, bytes, by characters: three times that there must be.
    for characters, taken in ((36_614, 53 << 20), (1_032_140, 308 << 20), (3_777_089, 930 << 20)):
        assert memory_of("x" * characters) == (1 << 30) + 512 * characters > 3 * taken
    for told, limit in (("max\n", 1 << 30), (f"{1 << 30}\n", 1 << 29), (f"{1 << 40}\n", 1 << 30)):
        container.write_text(told)
        assert memory_of("") == limit
    pages["SC_PHYS_PAGES"] = (1 << 30) // 4096
    assert memory_of("x" * 1_032_140) == 1 << 29
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert memory_of("x" * 1_032_140) == 1 << 27


@pytest.mark.parametrize("limits", [(300 << 20, 900 << 20), (resource.RLIM_INFINITY, 300 << 20)])
def test_a_limit_of_our_own_process_is_not_raised(monkeypatch, limits):
    monkeypatch.setattr(resource, "getrlimit", {resource.RLIMIT_AS: limits}.__getitem__)
    assert memory_of("x") == 300 << 20


@NEEDS_GCC
def test_a_text_that_takes_too_much_memory_is_told(temporary, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler_process, "LEAST_MEMORY", 100 << 20)
    assert build(doubled(10), find_compiler())
    with pytest.raises(
        NotNative, match="cc has not enough memory for it, of which it may have 100 MB: divide the task"
    ):
        build(doubled(30), find_compiler())
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("said", "code"),
    [
        ("gcc: fatal error: Killed signal terminated program cc1", 1),
        ("as: out of memory", 1),
        ("clang: error while loading shared libraries: libLLVM.so: failed to map segment from shared object", 127),
    ],
)
def test_a_compiler_that_the_machine_ends_for_its_memory_is_told_alike(tmp_path, said, code):
    path = compiler_of(tmp_path, f"echo first; echo '{said}' >&2; exit {code}")
    with pytest.raises(NotNative, match="has not enough memory for it"):
        run_compiler([str(path)], os.environ["PATH"])


@NEEDS_GCC
@pytest.mark.usefixtures("shell")
def test_where_a_limit_cannot_be_set_there_is_none(monkeypatch):
    monkeypatch.setattr(compiler_process, "memory_of", lambda _: -1024)
    assert build("int x;", find_compiler())


@pytest.mark.usefixtures("shell")
def test_a_compiler_that_is_not_there_is_told(tmp_path, temporary):
    with pytest.raises(NotNative, match=r"gone cannot be run: .*gone"):
        run_compiler([str(tmp_path / "gone")], os.environ["PATH"])
    assert list(temporary.iterdir()) == []


def test_without_a_folder_for_it_a_compiler_is_not_run(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))
    with pytest.raises(NotNative, match="true cannot be run: No such file or directory"):
        run_compiler(["/bin/true"], os.environ["PATH"])


@pytest.mark.usefixtures("shell")
def test_words_are_passed_on_as_they_are(tmp_path):
    words = ["a b", "$HOME", "`id`", "*", "'", '"', "\\", "-n", "", ";exit 1"]
    path = tmp_path / "its $PATH; exit 1"
    path.mkdir()
    compiler = compiler_of(path, "printf '%s\\n' \"$@\"")
    assert run_compiler([str(compiler), *words], os.environ["PATH"]).output.split("\n") == [*words, ""]


def test_what_a_killed_process_has_left_is_cleared_away(temporary, monkeypatch):
    now = time.time()
    ages = {f"{FOLDER}old": STALE_S + 60, f"{FOLDER}new": STALE_S - 60, "another": STALE_S + 60}
    for name, age in ages.items():
        (temporary / name).mkdir()
        (temporary / name / "text").touch()
        os.utime(temporary / name, (now - age,) * 2)
    (temporary / f"{FOLDER}link").symlink_to(temporary / "another")
    (temporary / f"{FOLDER}file").touch()
    os.utime(temporary / f"{FOLDER}file", (now - STALE_S - 60,) * 2)
    own = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: own + 1)
    run_compiler(["/bin/true"], os.environ["PATH"])
    assert (temporary / f"{FOLDER}old").exists()  # somebody else's
    monkeypatch.setattr(os, "geteuid", lambda: own)
    run_compiler(["/bin/true"], os.environ["PATH"])
    left = {path.name.removeprefix(FOLDER) for path in temporary.iterdir()}
    assert left == {"new", "another", "link", "file"}
    assert (temporary / "another" / "text").exists()


def test_what_leaves_the_compiler_s_session_and_holds_its_pipes_does_not_hold_us(tmp_path, temporary):
    child = tmp_path / "child"
    path = compiler_of(
        tmp_path, f"setsid sh -c 'echo $$ > {child}; exec sleep 100' & while [ ! -s {child} ]; do :; done"
    )
    begun = time.monotonic()
    with pytest.raises(NotNative, match="has not ended within 1 s"):
        run_compiler([str(path)], os.environ["PATH"], limit_s=1.0)
    assert time.monotonic() - begun < PATIENCE_S
    os.kill(int(child.read_text()), signal.SIGKILL)
    assert list(temporary.iterdir()) == []


@pytest.mark.usefixtures("shell")
def test_what_a_compiler_leaves_running_ends_with_it(tmp_path):
    child = tmp_path / "child"
    going_on = f"sh -c 'echo $$ > {child}; exec sleep 100' >/dev/null 2>&1 </dev/null &"
    path = compiler_of(tmp_path, f"{going_on} while [ ! -s {child} ]; do :; done; echo done; exit 3")
    with pytest.raises(NotNative, match="exit code 3"):
        run_compiler([str(path)], os.environ["PATH"])
    await_that(lambda: has_ended(int(child.read_text())))


RUNNING = """
import os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run in the background of a shell
from automax_ros.compile.native.run.cache import STALE_S
from automax_ros.compile.native.run.compiler_process import run_compiler
run_compiler([os.environ["CC"]], os.environ["PATH"])
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_however_we_end_the_compiler_ends_with_what_it_has_started(tmp_path, temporary, number):
    child = tmp_path / "child"
    path = begun_compiler_of(tmp_path, f"sh -c 'trap \"\" TERM; echo $$ > {child}; while :; do sleep 1000; done'")
    ours = subprocess.Popen(
        [sys.executable, "-c", RUNNING], env={**os.environ, "CC": str(path)}, stderr=subprocess.DEVNULL
    )
    begun = int((tmp_path / "begun").read_text())  # blocks until the compiler has begun
    await_that(lambda: child.exists() and child.read_text().endswith("\n"))
    assert len(list(temporary.iterdir())) == 1
    ours.send_signal(number)
    ours.wait(PATIENCE_S)
    await_that(lambda: has_ended(begun) and has_ended(int(child.read_text())))
    await_that(lambda: list(temporary.iterdir()) == [])


def test_what_is_abandoned_takes_no_other_thread_s_compiler_along(tmp_path):
    numbers, goes_on, said = [], tmp_path / "goes_on", []
    os.mkfifo(goes_on)

    def run(folder, ending):
        folder.mkdir()
        path = begun_compiler_of(folder, ending)
        with contextlib.suppress(NotNative):
            said.append(run_compiler([str(path)], os.environ["PATH"]).output)

    threads = []
    for name, ending in (("first", "exec sleep 1000"), ("second", f"cat {goes_on}")):
        threads.append(threading.Thread(target=run, args=(tmp_path / name, ending)))
        threads[-1].start()
        await_that((tmp_path / name / "begun").exists)
        numbers.append(int((tmp_path / name / "begun").read_text()))
    abandon(threads[:1])
    threads[0].join()
    await_that(lambda: has_ended(numbers[0]))
    goes_on.write_text("it went on")
    threads[1].join()
    assert said == ["it went on"]
