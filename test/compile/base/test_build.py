import ctypes
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from waiting import has_ended, wait_until

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run import build
from automax_ros.compile.native.run.build import find_compiler, key_of, library, python_options
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import native_form
from compile.native.support import begun_compiler_of, compiler_of
from compile.support import compiled_of, lines

ANSWER = "int answer(void) { return 42; }\n"


@pytest.fixture
def cache(tmp_path):
    return NativeCache(tmp_path / "cache")


def files_of(cache):
    return sorted(path.name for path in cache.folder.iterdir()) if cache.folder.exists() else []


def test_a_text_becomes_a_library_once(cache, monkeypatch):
    path = library(ANSWER, cache)
    assert ctypes.CDLL(str(path)).answer() == 42
    monkeypatch.setattr(build, "build", lambda *_: pytest.fail("built again"))
    assert library(ANSWER, cache) == path


def test_a_damaged_library_is_built_again(cache):
    path = library(ANSWER, cache)
    path.write_bytes(path.read_bytes()[:-100])
    assert ctypes.CDLL(str(library(ANSWER, cache))).answer() == 42


def test_the_key_depends_on_all_that_a_library_is_made_of(monkeypatch):
    compiler = build.Compiler("/usr/bin/cc", "cc 1", "/usr/bin")
    keys = {
        key_of(ANSWER, compiler),
        key_of(ANSWER + " ", compiler),
        key_of(ANSWER, compiler, ("-g",)),
        key_of(ANSWER, build.Compiler("/usr/bin/gcc", "cc 1", "/usr/bin")),
        key_of(ANSWER, build.Compiler("/usr/bin/cc", "cc 2", "/usr/bin")),
    }
    monkeypatch.setattr(build.platform, "machine", lambda: "another")
    keys.add(key_of(ANSWER, compiler))
    assert len(keys) == 6


def test_without_a_compiler_it_says_what_to_install(cache, monkeypatch, tmp_path):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(NotNative, match="there is no C compiler: install gcc"):
        library(ANSWER, cache)
    assert files_of(cache) == []


def test_a_compiler_in_the_working_folder_is_not_used(monkeypatch, tmp_path):
    compiler_of(tmp_path, "exit 0")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CC", raising=False)
    for path in (".", "", f".{os.pathsep}"):
        monkeypatch.setenv("PATH", path)
        with pytest.raises(NotNative, match="there is no C compiler"):
            find_compiler()


def test_cc_names_another(monkeypatch, tmp_path):
    path = compiler_of(tmp_path, "exit 0")
    monkeypatch.setenv("CC", str(path))
    assert (find_compiler().path, find_compiler().version) == (str(path), "fake 1")
    monkeypatch.setenv("CC", "cc")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    assert find_compiler().path == str(path)


def test_cc_must_be_a_whole_path_or_on_the_path(monkeypatch, tmp_path):
    compiler_of(tmp_path, "exit 0")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CC", "./cc")
    with pytest.raises(NotNative, match=r"CC=\./cc is neither a whole path nor a name on PATH"):
        find_compiler()
    monkeypatch.setenv("CC", "no-such-compiler -O9")
    with pytest.raises(NotNative, match="CC names no-such-compiler -O9, which is not there"):
        find_compiler()


def test_a_compiler_that_fails_is_quoted_and_leaves_nothing(cache, monkeypatch, tmp_path):
    monkeypatch.setenv("CC", str(compiler_of(tmp_path, "echo 'cc: out of sorts' >&2; exit 3")))
    with pytest.raises(NotNative, match="cc fails: cc: out of sorts"):
        library(ANSWER, cache)
    assert files_of(cache) == []
    monkeypatch.delenv("CC")
    with pytest.raises(NotNative, match=r"fails: .*error"):
        library("int answer(void) { return }\n", cache)


def test_a_text_that_is_too_long_is_not_given_to_a_compiler(cache):
    with pytest.raises(NotNative, match="its C text would have 4,000,032 characters, more than 4,000,000"):
        library(ANSWER + " " * 4_000_000, cache)
    assert files_of(cache) == []


def test_a_compiler_that_writes_nothing_is_told(cache, monkeypatch, tmp_path):
    monkeypatch.setenv("CC", str(compiler_of(tmp_path, "exit 0")))
    with pytest.raises(NotNative, match="cc has written no library"):
        library(ANSWER, cache)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")
def test_names_of_folders_may_be_any_bytes(monkeypatch, tmp_path):
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff"))
    folder.mkdir()
    (folder / "gcc").symlink_to(shutil.which("gcc"))
    monkeypatch.setenv("CC", str(folder / "gcc"))
    compiled = compiled_of(lines("A% = A% + 1", declare="LOCAL A%"))
    native = native_form(compiled, NativeCache(folder / "cache"))
    state = compiled.layout.fresh()
    assert native.columns(state, [], 3).done == 3
    assert state == [3]


def test_a_compiler_that_cannot_be_run_is_told(cache, monkeypatch, tmp_path):
    path = compiler_of(tmp_path, "exit 0")
    path.write_bytes(b"\x7fELF, but not really")
    monkeypatch.setenv("CC", str(path))
    with pytest.raises(NotNative, match="cc cannot be run"):
        library(ANSWER, cache)


def test_a_compiler_that_hangs_is_ended_with_all_it_has_started(cache, monkeypatch, tmp_path):
    started = tmp_path / "started"
    monkeypatch.setenv("CC", str(compiler_of(tmp_path, f"sleep 1000 & echo $! > {started}; wait")))
    with pytest.raises(NotNative, match="cc has not ended within 1 s"):
        library(ANSWER, cache, limit_s=1.0)
    child = int(started.read_text())
    wait_until(lambda: has_ended(child))
    assert files_of(cache) == []


def test_variables_that_steer_a_compiler_do_not_reach_it(cache, monkeypatch, tmp_path):
    seen = tmp_path / "seen"
    monkeypatch.setenv("CC", str(compiler_of(tmp_path, f"env > {seen}; exit 1")))
    for name in ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "COMPILER_PATH", "GCC_EXEC_PREFIX", "LD_PRELOAD", "CFLAGS"):
        monkeypatch.setenv(name, "" if name == "LD_PRELOAD" else "/tmp/x")
    with pytest.raises(NotNative):
        library(ANSWER, cache)
    names = {line.partition("=")[0] for line in seen.read_text().splitlines()}
    assert names - {"PWD", "OLDPWD", "SHLVL", "_"} == {"PATH", "TMPDIR", "LC_ALL"}


def test_python_h_is_asked_for_by_its_package(monkeypatch, tmp_path):
    monkeypatch.setattr(sysconfig, "get_path", lambda _: str(tmp_path))
    with pytest.raises(NotNative, match=r"Python\.h is missing: install python3\.\d+-dev"):
        python_options()


BUILDING = """
import ctypes, sys
from pathlib import Path
from automax_ros.compile.native.run.build import library
from automax_ros.compile.native.run.cache import NativeCache
path = library("int answer(void) { return 42; }", NativeCache(Path(sys.argv[1])))
assert ctypes.CDLL(str(path)).answer() == 42
"""


def test_two_processes_that_build_at_once_both_load_it(cache):
    both = [subprocess.Popen([sys.executable, "-c", BUILDING, str(cache.folder)]) for _ in range(2)]
    assert [process.wait() for process in both] == [0, 0]
    assert [name.endswith(".so") for name in files_of(cache)] == [True]


def test_a_builder_that_is_killed_leaves_nothing_harmful(cache, tmp_path):
    environment = {**os.environ, "CC": str(begun_compiler_of(tmp_path))}
    builder = subprocess.Popen([sys.executable, "-c", BUILDING, str(cache.folder)], env=environment)
    compiler = int((tmp_path / "begun").read_text())  # blocks until the compiler has begun
    builder.kill()
    builder.wait()
    wait_until(lambda: has_ended(compiler))
    assert not [name for name in files_of(cache) if name.endswith(".so")]
    assert ctypes.CDLL(str(library(ANSWER, cache))).answer() == 42
