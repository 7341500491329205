"""docs/network.md says what a 57C404 is: its table holds the registers, its two racks are linked."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from automax_ros.rackfile.modules.network import AREA, registers_of
from rack.modules.network_racks import Cable, built

PAGE = (Path(__file__).parents[3] / "docs" / "network.md").read_text(encoding="utf-8")
DROP = 3


def table() -> list[tuple[str, list[int], str, str]]:
    """The rows of the page's table: drop, its registers, their direction in the master and in a slave."""
    found = re.findall(r"^\| (a slave's|0) \| ([\d to,]+) \| (\w+) \| (\w+) \|", PAGE, re.M)
    rows = []
    for drop, text, master, slave in found:
        numbers = [int(number) for number in re.findall(r"\d+", text)]
        rows.append((drop, list(range(numbers[0], numbers[1] + 1)) if " to " in text else numbers, master, slave))
    return rows


@pytest.mark.parametrize(("column", "drop"), [(2, 0), (3, DROP)], ids=["master", "slave"])
def test_the_table_has_the_direction_of_each_register(column, drop):
    registers = registers_of(drop, 1)
    told: dict[int, str] = {}
    for row in table():
        base = 0 if row[0] == "0" else AREA * DROP
        told |= {base + number: row[column] for number in row[1]}
    area = {*range(AREA), *range(AREA * DROP, AREA * (DROP + 1))}
    real = {
        number: "reserved" if number in registers.reserved else registers.direction(number) for number in sorted(area)
    }
    told |= dict.fromkeys(area - set(told), "reserved")
    told[18] = "input"  # abort errors, always 0: not worth a row
    assert told == real


def test_the_two_racks_are_linked(tmp_path):
    first, second = re.findall(r"```yaml\n(.*?)```", PAGE, re.S)
    line = "10 COMMON WIND_REF%\n20 CALL SCAN_LOOP(TICKS=1)\n30 CALL MOVE(INPUT1=900, OUTPUT1=WIND_REF%)\n40 END\n"
    winder = (
        "10 COMMON REF%, SPEED%, DEPTH%\n15 DEPTH% = 1\n20 CALL SCAN_LOOP(TICKS=1)\n"
        "30 CALL MOVE(INPUT1=REF%, OUTPUT1=SPEED%)\n40 END\n"
    )
    racks = [built(tmp_path / "line", first, line), built(tmp_path / "winder", second, winder)]
    cable = Cable(*racks).start()
    cable.cycles(5)
    assert racks[0].value("WIND_SPEED%") == 900
    assert racks[0].value("WIND_THERE@")
    assert racks[1].value("LINE_THERE@")
