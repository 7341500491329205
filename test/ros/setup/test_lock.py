"""The lock that lets one rack of a name run in a ROS domain; system/running/test_stopping.py: between processes."""

import os

import pytest

from automax_ros.ros.setup.environment import RosUnavailable
from automax_ros.ros.setup.lock import InstanceLock, LockError, RackAlreadyRuns, domain_id


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def test_second_holder_is_told_who_holds_it():
    with InstanceLock("line1", 7):
        with pytest.raises(
            RackAlreadyRuns, match=rf"rack /line1 in ROS domain 7 runs already \(process {os.getpid()}\)"
        ):
            InstanceLock("line1", 7).__enter__()
        with InstanceLock("line1", 8), InstanceLock("line2", 7):
            pass


def test_lock_is_free_afterwards():
    for _ in range(3):
        with InstanceLock("line1", 7):
            pass


def test_processes_share_a_rack_and_hold_their_own():
    with InstanceLock("line1", 7, "processor_1"), InstanceLock("line1", 7, "processor_2"):
        with pytest.raises(
            RackAlreadyRuns, match=rf"processor_1 of rack /line1 in ROS domain 7 runs already \(process {os.getpid()}\)"
        ):
            InstanceLock("line1", 7, "processor_1").__enter__()
        with InstanceLock("line1", 7, "processor_3"):
            pass


def test_whole_rack_and_its_processes_exclude_each_other():
    with InstanceLock("line1", 7), pytest.raises(RackAlreadyRuns, match=rf"rack /line1 .* \(process {os.getpid()}\)"):
        InstanceLock("line1", 7, "processor_1").__enter__()
    with InstanceLock("line1", 7, "processor_1"):
        with pytest.raises(RackAlreadyRuns, match=r"\(distributed over several processes\)"):
            InstanceLock("line1", 7).__enter__()
        with InstanceLock("line1", 8):
            pass
    with InstanceLock("line1", 7):
        pass


def test_rack_below_a_namespace_has_a_lock_of_its_own():
    with InstanceLock("plant/line1", 7), InstanceLock("plant_line1", 7), InstanceLock("line1", 7):
        pass


def test_lock_is_free_after_an_error():
    with pytest.raises(ZeroDivisionError), InstanceLock("line1", 7):
        raise ZeroDivisionError
    with InstanceLock("line1", 7):
        pass


def test_link_in_the_way_is_refused(folder):
    (folder / "elsewhere").write_text("keep")
    (folder / f"automax_ros_{os.getuid()}_7_line1.lock").symlink_to(folder / "elsewhere")
    with pytest.raises(LockError, match="cannot open the lock file"):
        InstanceLock("line1", 7).__enter__()
    assert (folder / "elsewhere").read_text() == "keep"


@pytest.mark.parametrize(("text", "domain"), [(None, 0), ("", 0), ("0", 0), ("232", 232), (" 5 ", 5)])
def test_domain(monkeypatch, text, domain):
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    if text is not None:
        monkeypatch.setenv("ROS_DOMAIN_ID", text)
    assert domain_id() == domain


@pytest.mark.parametrize("text", ["-1", "233", "x", "1.5", "²", "9" * 5000])
def test_wrong_domain(monkeypatch, text):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(RosUnavailable, match="is not a number from 0 to 232"):
        domain_id()


def test_no_file_is_left_behind(folder):
    with InstanceLock("line1", 7):
        assert len(list(folder.iterdir())) == 1
    assert list(folder.iterdir()) == []
    with InstanceLock("line1", 7, "processor_1"):
        with InstanceLock("line1", 7, "processor_2"):
            pass
        assert len(list(folder.iterdir())) == 2, "the rack's own is shared, and one process is held"
    assert list(folder.iterdir()) == []
    with InstanceLock("line1", 7), pytest.raises(RackAlreadyRuns):
        InstanceLock("line1", 7).__enter__()
    assert list(folder.iterdir()) == []


def test_a_file_that_was_taken_away_meanwhile_does_not_lock(folder):
    """Between open and flock the holder may have ended: whoever comes then locks the file that stands there now."""
    first = InstanceLock("line1", 7)
    first.__enter__()
    (path,) = folder.iterdir()
    path.unlink()
    with InstanceLock("line1", 7):
        inode = path.stat().st_ino
        first.__exit__(None, None, None)
        assert path.stat().st_ino == inode, "the other's file is left alone"
