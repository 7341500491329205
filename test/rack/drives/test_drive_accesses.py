"""Accesses of the application to a 57C406 delay its microprocessor in modeled execution (52.7)."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.drive.current_loop.signals import late_us
from automax_ros.rackfile.modules.drive import ACCESS_NS
from rack.helpers import rack_at
from rack.modeled.modeled_drives import follow, held

ACCESS_US = ACCESS_NS / 1000
NOTHING = "10 COMMON REF%\n100 CALL SCAN_LOOP(TICKS=1)\n110 END\n"
LATCHES = "10 COMMON TLD%, FAST@\n100 CALL SCAN_LOOP(TICKS=1)\n110 END\n"
READS = """\
10 COMMON TLD%
20 LOCAL K%, V%
100 START EVERY 1 TICKS
110 FOR K% = 1 TO 300
120 V% = TLD%
130 NEXT K%
140 END
"""
IOREADS = READS.replace("TLD%\n20", "REF%\n20").replace("V% = TLD%", "V% = IOREAD%(7, 4136)")
WRITES = READS.replace("V% = TLD%", "TLD% = 109")


def late(folder: Path, task: str, kind: str = "BLK", execution: str = "modeled", scans: int = 300) -> list[float]:
    """How late the commands of some scans took effect while a task runs on another Processor, us."""
    (folder / f"OTHER.{kind}").write_text(task)
    rack = held(folder, "57C435", rpm=0, execution=execution, others=f"OTHER: {{priority: 5, file: OTHER.{kind}}}")
    found = []
    for _ in range(scans):
        rack.run(1 / 360)
        found.append(late_us(rack.drives.port(7).measure(8).status))
    return found


@pytest.fixture
def usual(tmp_path):
    """How late commands are that nothing delays, us."""
    (only,) = set(late(tmp_path, NOTHING))
    return only


def test_each_register_that_is_latched_before_the_command_delays_it(tmp_path, usual):
    """Two of them, once in 5.5 ms: only scans that such a latch falls into are later."""
    found = late(tmp_path, LATCHES)
    assert set(found) == {usual, usual + 2 * ACCESS_US}
    assert 0 < found.count(usual + 2 * ACCESS_US) < len(found) / 2


@pytest.mark.parametrize("task", [READS, WRITES, IOREADS], ids=["reads", "writes", "ioreads"])
def test_a_basic_task_that_reads_or_writes_all_the_time_delays_by_each_access(tmp_path, usual, task):
    found = late(tmp_path, task, "BAS")
    assert min(found) == usual
    assert usual + 20 * ACCESS_US < max(found) < 2777
    assert all((item - usual) % ACCESS_US == 0 for item in found)


def test_in_ideal_execution_nothing_is_delayed(tmp_path):
    assert set(late(tmp_path, READS, "BAS", "ideal")) == {0}


def test_a_delay_ends_before_the_next_interrupt_and_the_current_stands(tmp_path, monkeypatch):
    """The gates go on by the DELTA before: however late commands are, none is lost."""
    monkeypatch.setattr("automax_ros.rack.modules.drive.ACCESS_NS", 100_000)
    (tmp_path / "OTHER.BAS").write_text(READS)
    rack = held(tmp_path, "57C435", rpm=600, others="OTHER: {priority: 5, file: OTHER.BAS}")
    for reference in (800, 2730, -2730):
        got = follow(rack, reference)
        assert got.mean == pytest.approx(reference, rel=0.03)
    assert rack.value("IOC@") is False


def test_a_state_with_a_delayed_command_goes_on_bit_for_bit(tmp_path):
    (tmp_path / "OTHER.BAS").write_text(READS)
    rack = held(tmp_path, "57C435", rpm=600, others="OTHER: {priority: 5, file: OTHER.BAS}")
    rack.write("REF%", 2000)
    rack.run(0.2)
    port = rack.drives.port(7)
    for _ in range(1000):
        if port.state()["delayed"] is not None:
            break
        rack.run(0.00001)
    state = rack.state()
    assert port.state()["delayed"] is not None
    other = rack_at(tmp_path / "rack.yaml")
    other.load(state)
    for one in (rack, other):
        one.run(0.1)
    assert other.state() == rack.state()
