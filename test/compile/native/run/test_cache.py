import os
import subprocess
import sys
from pathlib import Path

import pytest

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run.cache import STALE_S, NativeCache, user_folder

KEY, OTHER = "a" * 64, "b" * 64


@pytest.fixture
def cache(tmp_path):
    return NativeCache(tmp_path / "cache")


def test_what_is_stored_is_found(cache):
    assert cache.found(KEY) is None
    path = cache.store(KEY, b"library")
    assert cache.found(KEY) == path
    assert path.read_bytes().startswith(b"library")
    assert cache.found(OTHER) is None


def test_one_that_stands_under_the_name_of_another_is_not_loaded(cache):
    one, other = cache.store(KEY, b"one library"), cache.store(OTHER, b"another")
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    assert (cache.found(KEY), cache.found(OTHER)) == (None, None)


def test_only_the_user_can_read_and_write_it(cache):
    path = cache.store(KEY, b"library")
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("umask", [0o002, 0o000])
def test_folders_that_it_makes_are_the_user_s_own_whatever_the_umask(tmp_path, umask):
    before = os.umask(umask)
    try:
        path = NativeCache(tmp_path / "new" / "newer" / "cache").store(KEY, b"library")
    finally:
        os.umask(before)
    assert [folder.stat().st_mode & 0o777 for folder in path.parents[:3]] == [0o700] * 3


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777, 0o1777])
def test_a_folder_that_others_can_write_is_refused(cache, mode):
    path = cache.store(KEY, b"library")
    path.parent.chmod(mode)
    for use in (lambda: cache.found(KEY), lambda: cache.store(KEY, b"library")):
        with pytest.raises(NotNative, match="can be written by other users: chmod go-w"):
            use()


@pytest.mark.parametrize("mode", [0o620, 0o602, 0o666])
def test_a_file_that_others_can_write_is_refused(cache, mode):
    cache.store(KEY, b"library").chmod(mode)
    with pytest.raises(NotNative, match="can be written by other users"):
        cache.found(KEY)


def test_a_folder_above_that_others_can_write_is_refused(tmp_path):
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o777)
    cache = NativeCache(tmp_path / "shared" / "cache")
    with pytest.raises(NotNative, match="can be written by other users"):
        cache.store(KEY, b"library")
    (tmp_path / "shared").chmod(0o1777)  # with the sticky bit nobody can put another folder in its place
    assert cache.store(KEY, b"library")


def test_a_folder_of_another_user_is_refused(cache, monkeypatch):
    cache.store(KEY, b"library")
    monkeypatch.setattr(os, "geteuid", lambda: 4711)
    with pytest.raises(NotNative, match="belongs to another user"):
        cache.found(KEY)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_is_given_to_another_user_is_refused(cache, what):
    path = cache.store(KEY, b"library")
    os.chown(path if what == "file" else path.parent, 65534, 65534)
    with pytest.raises(NotNative, match="belongs to another user"):
        cache.found(KEY)


def test_links_are_not_followed(cache, tmp_path):
    path = cache.store(KEY, b"library")
    elsewhere = tmp_path / "elsewhere.so"
    path.rename(elsewhere)
    path.symlink_to(elsewhere)
    with pytest.raises(NotNative, match="cannot be kept in"):
        cache.found(KEY)
    path.unlink()
    moved = tmp_path / "moved"
    path.parent.rename(moved)
    path.parent.symlink_to(moved)
    with pytest.raises(NotNative, match="cannot be kept in"):
        cache.found(OTHER)


def test_what_is_not_a_file_is_refused(cache):
    folder = cache.store(OTHER, b"library").parent
    (folder / f"{KEY}.so").mkdir(mode=0o700)
    with pytest.raises(NotNative, match="it is not what the cache has put there"):
        cache.found(KEY)
    (folder / f"{KEY}.so").rmdir()
    os.mkfifo(folder / f"{KEY}.so", 0o600)
    with pytest.raises(NotNative, match="it is not what the cache has put there"):
        cache.found(KEY)


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b[:0], lambda b: b[:20], lambda b: b"L" + b[1:]])
def test_a_damaged_file_counts_as_none(cache, damage):
    path = cache.store(KEY, b"library" * 100)
    path.write_bytes(damage(path.read_bytes()))
    assert cache.found(KEY) is None
    cache.store(KEY, b"library" * 100)
    assert cache.found(KEY) == path


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    cache = NativeCache(tmp_path / "cache", most_bytes=1100)
    for number, key in enumerate("abc"):
        os.utime(cache.store(key, bytes(300)), (1000 + number, 1000 + number))
    cache.found("a")
    cache.store("d", bytes(300))
    assert sorted(path.stem for path in (tmp_path / "cache").iterdir()) == ["a", "c", "d"]
    cache.store("e", bytes(2000))  # what was stored last stays, however large it is
    assert [path.stem for path in (tmp_path / "cache").iterdir()] == ["e"]


def test_what_killed_processes_leave_is_cleared_away(cache):
    folder = cache.store(KEY, b"library").parent
    old, new = folder / "x.1.unfinished", folder / "x.2.unfinished"
    old.write_bytes(b"half")
    new.write_bytes(b"half")
    os.utime(old, (os.stat(new).st_mtime - STALE_S - 60,) * 2)
    cache.store(OTHER, b"library")
    assert (old.exists(), new.exists()) == (False, True)
    assert cache.found("x") is None


def test_a_relative_xdg_cache_home_does_not_count(monkeypatch):
    monkeypatch.setenv("HOME", "/home/somebody")
    for value in ("", "cache", "./x"):
        monkeypatch.setenv("XDG_CACHE_HOME", value)
        assert user_folder() == Path("/home/somebody/.cache/automax_ros")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert user_folder() == Path("/home/somebody/.cache/automax_ros")
    monkeypatch.setenv("XDG_CACHE_HOME", "/var/somewhere")
    assert user_folder() == Path("/var/somewhere/automax_ros")


@pytest.mark.parametrize("home", [None, "", "somewhere"])
def test_without_a_home_there_is_nowhere_to_keep_it(monkeypatch, home):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("HOME") if home is None else monkeypatch.setenv("HOME", home)
    with pytest.raises(NotNative, match="set HOME, or XDG_CACHE_HOME"):
        user_folder()


def test_a_home_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "home").write_text("a file")
    with pytest.raises(NotNative, match=r"native code cannot be kept in .*set XDG_CACHE_HOME"):
        NativeCache(tmp_path / "home" / ".cache").found(KEY)


STORING = """
import sys
from pathlib import Path
from automax_ros.compile.native.run.cache import NativeCache
cache = NativeCache(Path(sys.argv[1]))
for number in range(100):
    cache.store("same", sys.argv[2].encode() * 20_000)
    assert cache.found("same") is not None
"""


def test_two_processes_at_once_both_find_whole_files(cache):
    command = [sys.executable, "-c", STORING, str(cache.folder)]
    both = [subprocess.Popen([*command, letter]) for letter in "xy"]
    assert [process.wait() for process in both] == [0, 0]
    path = cache.found("same")
    assert path is not None
    assert path.read_bytes()[:-32] in (b"x" * 20_000, b"y" * 20_000)
    assert [item.name for item in path.parent.iterdir()] == ["same.so"]
