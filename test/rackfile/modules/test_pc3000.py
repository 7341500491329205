"""The PC3000: a rack of one Processor without slots, with the times of table 6."""

from __future__ import annotations

import pytest
from rack.helpers import codes, good, write

from automax_ros.compile.base.cost import Model
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.cpu_load import loads_of
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.loader import load

RACK = """\
rack: PC1
execution: {execution}
slots:
  0:
    module: {module}
    tick_ms: 5
    tasks: {{LINE: {{priority: 5}}}}
common:
  COUNT%:
"""
LINE = """\
10 COMMON COUNT%
20 CALL SCAN_LOOP(TICKS=2)
30 CALL SUMMER(INPUT1=COUNT%, INPUT2=1, OUTPUT=COUNT%)
40 END
"""
SCAN_US = (56.00 + 1.12 + 1.76) + 7.88 + (9.68 + 1.40 + 1.12)
"""By hand from table 6; its lost INTEGER term of SCAN_LOOP is 0.7 of the 7010's 2.5."""


def rack_of(tmp_path, module="57C560", execution="ideal", task=LINE):
    config = good(tmp_path, RACK.format(module=module, execution=execution))
    (tmp_path / "LINE.BLK").write_text(task)
    return config


@pytest.mark.parametrize("module", ["57C560", "57C570", "57c560B"])
@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_its_task_runs(tmp_path, module, execution):
    rack = Rack(rack_of(tmp_path, module, execution))
    rack.start()
    rack.run(1.0)
    assert rack.value("COUNT%") == 100
    assert [item.config.name for item in rack.modules] == ["pc3000"]


def test_it_has_the_times_of_table_6(tmp_path):
    config = rack_of(tmp_path)
    (pc3000,) = loads_of(config, check_tasks(config))
    assert (pc3000.word, pc3000.module.times) == ("PC3000", Model.PC3000)
    assert pc3000.tasks[0].times.most_ns / 1000 == pytest.approx(SCAN_US, abs=0.01)
    assert pc3000.percent == pytest.approx(100 * SCAN_US / 10_000)


def test_a_modeled_scan_ends_when_its_time_has_passed(tmp_path):
    rack = Rack(rack_of(tmp_path, execution="modeled"))
    rack.start()
    rack.run((SCAN_US - 1) / 1e6)  # the first scan is due at 0
    assert rack.value("COUNT%") == 0
    rack.run(2 / 1e6)
    assert rack.value("COUNT%") == 1


@pytest.mark.parametrize(
    ("slots", "line"),
    [
        ("1: {module: 57C560}", 3),
        ("0: {module: 57C560}\n  1: {module: 57C435}", 4),
        ("0: {module: 57C560}\n  5: {module: 57C419}", 4),
        ("0: {module: 57C560}\n  1: {module: 57C570}", 4),
        ("0: {module: 57C560}\n  2: {module: 57C413}", 4),
    ],
)
def test_nothing_stands_next_to_it(tmp_path, slots, line):
    result = load(write(tmp_path, f"rack: PC1\nslots:\n  {slots}\n"))
    assert [(item.code, item.span.line) for item in result.diagnostics if item.code == "AMX6773"] == [("AMX6773", line)]
    assert result.config is None


def test_no_second_complaint_that_the_rack_has_no_processor(tmp_path):
    assert codes(tmp_path, "rack: PC1\nslots: {0: {module: 57C560}}\n") == []


def test_its_tasks_have_no_hardware_events(tmp_path):
    task = "10 COMMON COUNT%\n15 EVENT NAME=GO, INTERRUPT_STATUS=COUNT%, TIMEOUT=6\n" + LINE.partition("\n")[2]
    config = rack_of(tmp_path, task=task)
    (checked,) = check_tasks(config)
    assert [item.code for item in checked.result.diagnostics] == ["AMX4027"]


def test_its_tasks_may_not_use_a_udcs_blocks(tmp_path):
    task = LINE.replace("SUMMER(INPUT1=COUNT%, INPUT2=1, ", "NOTCHN(INPUT=COUNT%, Q_FACTOR=1.0, WN=5.0, ORDER=2, ")
    (checked,) = check_tasks(rack_of(tmp_path, task=task))
    assert [item.code for item in checked.result.diagnostics] == ["AMX4071"]
