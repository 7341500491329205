"""`automax diagram`: the picture of a task, or why there is none."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.support import TASK, WRONG

ROOT = Path(__file__).parents[3]


def test_the_picture_goes_to_a_file_or_to_standard_output(automax) -> None:
    name = automax.write("TASK.BLK", TASK)
    assert automax("diagram", name, "-o", "task.svg") == (0, "", "")
    picture = (automax.folder / "task.svg").read_text(encoding="utf-8")
    assert picture.startswith("<svg ")
    assert "<title>TASK</title>" in picture
    assert automax("diagram", name) == (0, picture, "")


def test_the_picture_of_the_page_is_what_the_command_makes(automax) -> None:
    """`tools/docs_pictures.py` renews it with the others."""
    result = automax("diagram", ROOT / "config" / "section_drive" / "SPEED.BLK")
    assert result.out == (ROOT / "docs" / "pictures" / "speed_diagram.svg").read_text(encoding="utf-8")


def test_a_wrong_task_has_its_errors(automax) -> None:
    result = automax("diagram", automax.write("TASK.BLK", WRONG), "-o", "task.svg")
    assert (result.code, result.out) == (1, "")
    assert "AMX" in result.err
    assert not (automax.folder / "task.svg").exists()


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("TASK.BLK", TASK.replace("220 SCALED", "220 IF RUN@ THEN 240\n225 SCALED"), "line 220: GOTO"),
        ("TASK.BAS", "10 LOCAL X%\n20 X% = 1\n30 END\n", "a BASIC task: it may wait and jump anywhere"),
    ],
)
def test_a_task_without_a_drawing_says_why(automax, name, text, why) -> None:
    result = automax("diagram", automax.write(name, text), "-o", "task.svg")
    assert result == (1, "", f"{name}: not drawn: {why}\n")
    assert not (automax.folder / "task.svg").exists()


def test_it_takes_target_and_tick(automax) -> None:
    name = automax.write(
        "TASK.BLK",
        TASK.replace("CALL SUMMER(", "CALL THERMAL_OVERLOAD(").replace(
            "INPUT1=REF%, INPUT2=TABLE%(3), OUTPUT=OUT%", "I_FDBK=REF%, LIM_BAR=150, OVERLOAD=RUN@"
        ),
    )
    assert automax("diagram", name).code == 1
    assert automax("diagram", name, "--target", "udc").code == 0


@pytest.mark.parametrize("output", ["TASK.BLK", "there/is/none.svg"])
def test_a_wrong_output_is_refused_before_anything_is_written(automax, output) -> None:
    name = automax.write("TASK.BLK", TASK)
    assert automax("diagram", name, "-o", output).code == 2
    assert (automax.folder / name).read_text() == TASK
