"""docs/udc.md says what a UDC is: its table of registers, its example."""

from __future__ import annotations

import re
from math import pi
from pathlib import Path

import pytest

from automax_ros.drive.pmi.registers import COMMAND_REGISTERS, DRIVE_B, FEEDBACK_REGISTERS, LINK_REGISTERS
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.modules.udc import RETAINED, UDC_REGISTERS
from rack.helpers import config_at, run_for

PAGE = (Path(__file__).parents[3] / "docs" / "udc.md").read_text(encoding="utf-8")
WHO = {
    "the process": "input",
    "tasks": "output",
    "tasks, never `ros: in` (AMX6494)": "output",
    "the module": "input",
}


def rows() -> dict[int, tuple[str, bool]]:
    """The direction of each register in the table, and whether it stays."""
    found: dict[int, tuple[str, bool]] = {}
    for line in PAGE.splitlines():
        cells = [cell.strip(" †") for cell in line.strip("|").split("|")]
        if len(cells) != 4 or cells[3] not in ("stay", "0"):
            continue
        direction = WHO.get(cells[2], "either")
        for first, last in re.findall(r"(\d+)(?: to (\d+))?", cells[0]):
            for number in range(int(first), int(last or first) + 1):
                found[number] = direction, cells[3] == "stay"
    return found


def test_the_table_has_every_register_that_is_not_the_modules_own():
    table = rows()
    assert set(table) == set(range(UDC_REGISTERS.count)) - set(UDC_REGISTERS.reserved)
    assert {number: direction for number, (direction, _) in table.items()} == {
        number: UDC_REGISTERS.direction(number) for number in table
    }
    assert {number for number, (_, stays) in table.items() if stays} == RETAINED


def test_the_example_runs(tmp_path):
    udc, line, _ = re.findall(r"```blk[^\n]*\n(.*?)```", PAGE, re.S)
    (tmp_path / "WIND_A.BLK").write_text(udc)
    (tmp_path / "LINE.BLK").write_text(line)
    (tmp_path / "rack.yaml").write_text(re.search(r"```yaml[^\n]*\n(.*?)```", PAGE, re.S)[1])
    config = config_at(tmp_path / "rack.yaml")
    assert [item.result.diagnostics for item in check_tasks(config)] == [[], []]
    rack = run_for(Rack(config))
    rack.write("S10A_PMI_FB%", 1000)
    rack.run(1.0)
    assert rack.operations.stopped is None
    assert rack.value("TORQUE%") == 700
    assert rack.value("SHOWN%") == 1000
    # Of its 500 scans the 10th, the 21st ... are followed by an interrupt.
    assert rack.task("LINE").scan_number == len(range(10, 501, 11)) == 45


def test_the_example_with_a_plant_turns_its_motor(tmp_path):
    (tmp_path / "WIND_A.BLK").write_text(re.findall(r"```blk[^\n]*\n(.*?)```", PAGE, re.S)[2])
    (tmp_path / "rack.yaml").write_text(re.findall(r"```yaml[^\n]*\n(.*?)```", PAGE, re.S)[1])
    config = config_at(tmp_path / "rack.yaml")
    assert [item.result.diagnostics for item in check_tasks(config)] == [[]]
    rack = run_for(Rack(config), 0.4)
    rack.write("RUN@", True)
    rack.run(0.4)
    rack.write("SPD_REF%", 2000)
    rack.run(4.0)
    assert rack.operations.stopped is None
    assert rack.value("FAULTS%") == 0
    assert rack.plants["WINDER"].motor.speed_rad_s * 30 / pi == pytest.approx(2000 / 4095 * 1750, rel=0.01)


def table_of(registers):
    """The rows of the page for registers of a PMI."""
    for item in registers:
        yield f"| {item.number}, {item.number + DRIVE_B} | | {item.meaning} |"
        yield from (f"| | {bit} | {meaning} |" for bit, meaning in item.bits)


def test_the_table_of_the_pmi_is_that_of_the_program():
    rows = list(table_of((*COMMAND_REGISTERS, *FEEDBACK_REGISTERS, *LINK_REGISTERS)))
    first = PAGE.index(rows[0])
    assert PAGE[first:].split("\n\n")[0].splitlines() == rows
