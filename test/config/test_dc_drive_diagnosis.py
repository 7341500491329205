"""What DIAG names of a broken bridge, over speeds, loads, both directions, motoring and braking (52.3.2)."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest
from rack.helpers import rack_at

from automax_ros.drive.plant.faults import execute_verb, values_of
from automax_ros.rack.rack import Rack

EXAMPLE = Path(__file__).parents[2] / "config" / "dc_drive"
SPEEDS_RPM = (500, 720, 930, 1130, 1340, 1550, 1750)
LOADS = (8, 12, 18, 25, 35, 48, 60)
"""Current reference, % of LIM_BAR."""
GATE_LIMIT, FUSE_LIMIT = 45_000, 23_500
"""Speed (rpm) times load (%) up to which a braking drive outlives an open gate and a blown fuse: beyond it the missing
pulse is a commutation that fails, and the motor drives its current through the line until IOC trips."""


class Point(NamedTuple):
    """A speed (rpm), a reference (counts) and what breaks; what LOST_PHASE% and OPEN_GATE% shall be."""

    rpm: int
    reference: int
    verb: str
    value: str
    lost_phase: int
    open_gate: int

    @property
    def brakes(self) -> bool:
        """Whether the motor feeds the line."""
        return self.rpm * self.reference < 0

    @property
    def must_live(self) -> bool:
        """Whether the drive has to outlive the fault."""
        limit = GATE_LIMIT if self.verb == "open_gate" else FUSE_LIMIT
        return not self.brakes or abs(self.rpm * self.reference) / 40.95 <= limit


def points() -> list[Point]:
    """Return the whole table: each SCR and each terminal in turn."""
    found: list[Point] = []
    for speed in SPEEDS_RPM:
        for rpm in (speed, -speed):
            for percent in LOADS:
                for sign in (1, -1):
                    reference = round(40.95 * percent) * sign
                    scr, terminal = 1 + len(found) // 4 % 6, 1 + len(found) // 4 % 3
                    scr += 0 if reference > 0 else 10
                    found += [
                        Point(rpm, reference, "open_gate", str(scr), 0, scr),
                        Point(rpm, reference, "blow_fuse", f"T{terminal}", terminal, 0),
                    ]
    return found


def held(folder: Path, rpm: int, execution: str, model: str) -> Rack:
    """Return the example's loop and DIAG on a shaft that is held; the loop runs, without a reference."""
    text = (EXAMPLE / "rack.yaml").read_text()
    for name in ("CML.BLK", "DIAG.BAS"):
        (folder / name).write_text((EXAMPLE / name).read_text())
    left_out = ("SPEED: {priority", "SEQ: {priority", "INIT: {priority", "joint:", "velocity: {")
    lines = [line for line in text.splitlines() if not line.strip().startswith(left_out)]
    lines = [f"    load: {{speed_rpm: {rpm}}}" if line.strip().startswith("load:") else line for line in lines]
    text = "\n".join(lines).replace("57C435", model).replace("operator: true", f"execution: {execution}", 1)
    (folder / "rack.yaml").write_text(text + "\n")
    rack = rack_at(folder / "rack.yaml")
    rack.start()
    rack.run(0.6)
    rack.write("CML_RUN@", True)
    rack.run(0.5)
    return rack


def said(rack: Rack) -> tuple[int, int]:
    """Return LOST_PHASE% and OPEN_GATE%."""
    return int(rack.value("LOST_PHASE%")), int(rack.value("OPEN_GATE%"))


def assert_named(folder: Path, point: Point, execution: str = "ideal", model: str = "57C435") -> None:
    rack = held(folder, point.rpm, execution, model)
    rack.write("CUR_REF%", point.reference)
    for _ in range(6):
        rack.run(0.5)
        assert said(rack) == (0, 0), "nothing is broken yet"
    execute_verb(rack.plants["MOTOR"], point.verb, values_of(point.verb, point.value))
    rack.run(3.0)
    lives = rack.value("CML_STATE@")
    assert lives or not point.must_live, point
    if lives:
        assert said(rack) == (point.lost_phase, point.open_gate), point


@pytest.mark.parametrize("point", points()[::19], ids=str)
def test_diag_names_what_is_broken(tmp_path, point):
    assert_named(tmp_path, point)


@pytest.mark.parametrize("point", points()[7::61], ids=str)
def test_diag_names_what_is_broken_in_modeled_execution(tmp_path, point):
    assert_named(tmp_path, point, "modeled", "57C430A")


@pytest.mark.soak
@pytest.mark.parametrize(("execution", "model"), [("ideal", "57C435"), ("modeled", "57C430A"), ("modeled", "57C435")])
@pytest.mark.parametrize("speed", SPEEDS_RPM)
def test_diag_names_what_is_broken_at_every_point(tmp_path, speed, execution, model):
    for point in points():
        if abs(point.rpm) == speed:
            assert_named(tmp_path, point, execution, model)


def test_the_table_is_whole():
    table = points()
    assert len(table) == 392
    assert {point.open_gate for point in table} == {0, *range(1, 7), *range(11, 17)}
    assert {point.lost_phase for point in table} == {0, 1, 2, 3}
    assert sum(point.must_live for point in table) >= 300
