"""What `automax check` says of the commons of a rack: two writers, none, no user; and of drives without a plant."""

from pathlib import Path

import pytest

from automax_ros.rackfile.checks.tasks import check_tasks, forgotten
from automax_ros.rackfile.loader import load

CONFIG = Path(__file__).parents[3] / "config"
RACK = """\
rack: PM1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {ONE: {priority: 5}, TWO: {priority: 6}}}
  2: {module: 57C435, tasks: {LOG: {priority: 7, file: LOG.BAS}}}
  5: {module: 57C419}
  6: {module: 57C403}
common:
"""
HEAD = "10 COMMON {}\n20 LOCAL I%, OWN%, OWN@\n{}100 CALL SCAN_LOOP(TICKS=2)\n{}900 END\n"


def found(folder: Path, common: str, one: str = "", two: str = "", log: str = "", **startup: str) -> list[str]:
    """Codes with messages; each of ``one`` and ``two`` is ``DECLARED: STATEMENT``, ``log`` a BASIC task's lines."""
    for name, text in (("ONE", one), ("TWO", two)):
        declared, _, statement = text.partition(": ")
        before = startup.get(name.lower() + "_first")
        lines = "" if not statement else f"110 {statement}\n"
        source = HEAD.format(declared or "NONE%", f"30 {before}\n" if before else "", lines)
        (folder / f"{name}.BLK").write_text(source if declared else source.replace("10 COMMON NONE%\n", ""))
    (folder / "LOG.BAS").write_text(log or "10 LOCAL X%\n20 X% = 1\n30 END\n")
    (folder / "rack.yaml").write_text(RACK + "".join(f"  {line}\n" for line in common.split("; ")))
    config = load(folder / "rack.yaml").config
    assert config is not None, load(folder / "rack.yaml").diagnostics
    tasks = check_tasks(config)
    assert all(item.result.program is not None for item in tasks), [item.result.diagnostics for item in tasks]
    items = [item for task in tasks for item in task.result.diagnostics] + forgotten(config, tasks)
    return [f"{item.code} {item.span.line} {item.message}" for item in items if item.code.startswith("AMX649")]


def codes(*arguments: str, **options: str) -> list[str]:
    return [text.split()[0] for text in found(*arguments, **options)]


def test_both_places_of_two_writers_are_named(tmp_path):
    assert found(tmp_path, "A%: {}", "A%: A% = 1", "A%: CALL LIMIT(INPUT=OWN%, LIMIT_PLUS=5, OUTPUT=A%)") == [
        "AMX6495 4 A% is written here, and in line 110 of ONE.BLK by task ONE"
    ]


@pytest.mark.parametrize(
    ("common", "one", "two", "log"),
    [
        ("A%: {}", "A%: A% = 1", "A%: OWN% = A%", ""),
        ("T%(5): {}", "T%(5): T%(1) = 1", "T%(5): T%(2) = OWN%", ""),
        ("T%(5): {}", "T%(5): T%(1) = 1", "T%(5): T%(I%) = OWN%", ""),
        ("REQUEST@: {}", "REQUEST@: IF OWN@ THEN REQUEST@ = TRUE", "REQUEST@: REQUEST@ = FALSE", ""),
        ("A%: {}", "A%: A% = 1", "", "10 COMMON A%\n20 A% = 7\n30 END\n"),
    ],
)
def test_no_false_alarm_of_two_writers(tmp_path, common, one, two, log):
    assert codes(tmp_path, common, one, two, log) == []


def test_what_stands_before_scan_loop_initialises(tmp_path):
    assert codes(tmp_path, "A%: {}", "A%: A% = 1", "A%: OWN% = A%", two_first="A% = 5") == []


@pytest.mark.parametrize(
    ("common", "one", "two", "log"),
    [
        ("T%(5): {}", "T%(5): T%(2) = 1", "T%(5): T%(2) = OWN%", ""),
        ("REQUEST@: {}", "REQUEST@: REQUEST@ = OWN@", "REQUEST@: REQUEST@ = FALSE", ""),
        ("A%: {}", "A%: A% = 1", "", "10 COMMON A%\n20 A% = 7\n30 GOTO 20\n40 END\n"),
        ("A%: {}", "A%: A% = 1", "", "10 COMMON A%\n20 START EVERY 1 SECONDS\n30 A% = 7\n40 END\n"),
        ("LAMP%: {slot: 6, register: 0}", "LAMP%: LAMP% = 1", "LAMP%: LAMP% = OWN%", ""),
    ],
)
def test_two_writers(tmp_path, common, one, two, log):
    assert codes(tmp_path, common, one, two, log) == ["AMX6495"]


def test_what_is_read_and_never_written_is_named_with_its_reader(tmp_path):
    assert found(tmp_path, "A%: {}", "A%: OWN% = A%") == [
        "AMX6496 9 A% is read in line 110 of ONE.BLK, and no task writes it: it stays 0"
    ]
    assert found(tmp_path, "A@: {}", "A@: CALL OR(INPUT1=A@, OUTPUT=OWN@)")[0].endswith("it stays FALSE")


@pytest.mark.parametrize(
    ("common", "one", "two"),
    [
        ("A%: {ros: in}", "A%: OWN% = A%", ""),
        ("A%: {preset: 0}", "A%: OWN% = A%", ""),
        ("A%: {slot: 5, register: 0}", "A%: OWN% = A%", ""),
        ("A%: {slot: 6, register: 0}", "A%: OWN% = A%", ""),
        ("FORCINGSTATUS@: {}", "FORCINGSTATUS@: OWN@ = FORCINGSTATUS@", ""),
        ("A%: {}", "A%: OWN% = A%", "A%: A% = 3"),
        ("T%(3): {}", "T%(3): OWN% = T%(1)", "T%(3): T%(I%) = 3"),
    ],
)
def test_what_somebody_writes(tmp_path, common, one, two):
    assert codes(tmp_path, common, one, two) == []


def test_a_first_value_before_scan_loop_is_a_write(tmp_path):
    assert codes(tmp_path, "A%: {}", "A%: OWN% = A%", two="A%: ", two_first="A% = 5") == []


def test_one_warning_for_all_commons_that_no_task_uses(tmp_path):
    common = "; ".join(
        ["A%: {}", *(f"V{number}%: {{ros: in}}" for number in range(8)), "P@: {slot: 5, register: 0, bit: 1}"]
    )
    (text,) = found(tmp_path, common, "A%: A% = 1")
    names = ", ".join(f"V{number}% (line {number + 10})" for number in range(6))
    assert text == f"AMX6497 10 the commons {names} and 2 more are used by no task"


def test_nothing_is_said_to_be_forgotten_while_a_task_has_errors(tmp_path):
    found(tmp_path, "A%: {}; B%: {}", "A%: OWN% = A%")
    (tmp_path / "TWO.BLK").write_text("10 NONSENSE\n")
    config = load(tmp_path / "rack.yaml").config
    assert config is not None
    assert forgotten(config, check_tasks(config)) == []


@pytest.mark.parametrize("path", sorted(CONFIG.rglob("rack.yaml")), ids=lambda path: path.parent.name)
def test_example_racks_are_free_of_them(path):
    config = load(path).config
    assert config is not None
    tasks = check_tasks(config)
    items = [item for task in tasks for item in task.result.diagnostics] + forgotten(config, tasks)
    assert [item.code for item in items if item.code.startswith("AMX649")] == []
