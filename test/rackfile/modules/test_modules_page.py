"""docs/modules.md says what the modules are: its table holds their registers, its example runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rack.helpers import config_at, written_in

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.module import Registers
from automax_ros.rackfile.modules.registry import KINDS

PAGE = (Path(__file__).parents[3] / "docs" / "modules.md").read_text(encoding="utf-8")
MODELS = {number: registers for kind in KINDS for number, registers in kind.table.items()}


def rows() -> dict[str, dict[int, str]]:
    """The direction of each register of each module, as the table has it."""
    table: dict[str, dict[int, str]] = {}
    modules: list[str] = []
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("| ") else []
        if len(cells) != 4 or cells[2] not in ("input", "output", "either"):
            continue
        modules = re.findall(r"57C\d{3}", cells[0]) or modules
        numbers = [int(number) for number in re.findall(r"\d+", cells[1])]
        taken = range(numbers[0], numbers[-1] + 1) if " to " in cells[1] else numbers
        for module in modules:
            table.setdefault(module, {}).update(dict.fromkeys(taken, cells[2]))
    return table


@pytest.mark.parametrize("model", MODELS)
def test_the_table_has_every_register_in_its_direction(model):
    registers: Registers = MODELS[model]
    assert rows()[model] == {
        number: registers.direction(number) for number in range(registers.count) if number not in registers.reserved
    }


@pytest.mark.parametrize("model", [model for model, registers in MODELS.items() if registers.interrupts])
def test_every_period_and_status_register_of_an_interrupt_is_an_output(model):
    registers = MODELS[model]
    for interrupt in registers.interrupts:
        assert {interrupt.status, interrupt.period} <= set(registers.outputs)
        assert {registers.direction(number) for number in interrupt.inputs} == {"input"}


def test_the_example_scans_every_22_ms(tmp_path):
    task, rack_file = (re.search(rf"```{word}[^\n]*\n(.*?)```", PAGE, re.S)[1] for word in ("blk", "yaml"))
    config = config_at(written_in(tmp_path, rack_file, SPEED=task))
    assert [item.result.diagnostics for item in check_tasks(config)] == [[]]
    rack = Rack(config)
    rack.start()
    rack.write("POSITION%", 500)
    rack.run(0.1)
    assert (rack.task("SPEED").scan_number, rack.task("SPEED").value("LAST%")) == (4, 500)
