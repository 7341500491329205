"""automax compile --native: the C of a task's scans, or why there is none."""

from __future__ import annotations

from automax_ros.cli.main import main

TASK = "10 COMMON A%, B%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL SUMMER(INPUT1=A%, INPUT2=7, OUTPUT=B%)\n{more}90 END\n"


def test_the_c_of_the_scans_is_printed(tmp_path, capsys) -> None:
    path = tmp_path / "PUMP.BLK"
    path.write_text(TASK.format(more=""))
    assert main(["compile", str(path), "--native"]) == 0
    out = capsys.readouterr().out
    assert "B_i = A_i + 7;" in out
    assert "int automax_scan(automax_slot *slots" in out
    assert "def scans(" not in out


def test_a_task_that_cannot_be_native_is_told_with_its_line(tmp_path, capsys) -> None:
    path = tmp_path / "PUMP.BLK"
    path.write_text(TASK.format(more="40 PRINT A%\n"))
    assert main(["compile", str(path), "--native"]) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err == f"{path}: not native: line 40: PRINT\n"
