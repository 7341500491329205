"""The tasks of a rack are checked against the rack."""

from rack.helpers import HEAD, good

from automax_ros.core.types import DataType
from automax_ros.rackfile.checks.tasks import check_tasks, commons_of

COMMON = f"{HEAD}common:\n  A%:\n  B@(3,4):\n  C$:20:\n"


def findings(config):
    return [item.message for checked in check_tasks(config) for item in checked.result.diagnostics]


def test_commons_tell_type_size_length_and_place(tmp_path):
    commons = commons_of(good(tmp_path, COMMON.replace("C$:20:", "C$:20: {}")))
    assert list(commons) == ["A%", "B@", "C$"]
    assert commons["A%"].place == "rack.yaml:5"
    assert (commons["B@"].type, commons["B@"].dimensions) == (DataType.BOOLEAN, (4, 5))
    assert commons["C$"].length == 20


def test_good_task_becomes_a_program_of_its_name_and_tick(tmp_path):
    config = good(tmp_path, HEAD.replace("57C435,", "57C435, tick_ms: 2.5,"))
    ((task, source, result),) = check_tasks(config)
    assert (task.name, source.name) == ("LINE", str(tmp_path / "LINE.BLK"))
    assert result.diagnostics == []
    assert result.program is not None
    assert (result.program.name, result.program.tick_ns) == ("LINE", 2_500_000)


def test_task_that_the_rack_does_not_fit(tmp_path):
    config = good(tmp_path, COMMON)
    text = "5 COMMON A!, B@(3), D%\n10 CALL SCAN_LOOP(TICKS=1)\n20 END\n"
    (tmp_path / "LINE.BLK").write_text(text)
    assert findings(config) == [
        "A! is DOUBLE INTEGER here, A% at rack.yaml:5 is INTEGER",
        "B@ is an array (3) here, an array (3,4) at rack.yaml:6",
        "the rack does not define the common D%",
    ]


def test_source_that_vanished_is_an_error_at_the_task(tmp_path):
    config = good(tmp_path, HEAD)
    (tmp_path / "LINE.BLK").unlink()
    ((task, source, result),) = check_tasks(config)
    assert result.program is None
    assert [(item.code, item.span.line) for item in result.diagnostics] == [("AMX6306", task.line)]
    assert source.name == str(config.path)


def test_old_bytes_in_a_remark(tmp_path):
    config = good(tmp_path, HEAD)
    (tmp_path / "LINE.BLK").write_bytes(b"5 ! 20 \xf8C\r\n10 CALL SCAN_LOOP(TICKS=1)\r\n20 END\r\n")
    assert findings(config) == []


def test_task_that_waits_for_an_event_of_no_module(tmp_path):
    config = good(tmp_path, f"{HEAD}common:\n  ISCR%:\n")
    event = "7 EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=6\n"
    text = f"5 COMMON ISCR%\n{event}10 CALL SCAN_LOOP(TICKS=1, EVENT=GO)\n20 END\n"
    (tmp_path / "LINE.BLK").write_text(text)
    ((_, _, result),) = check_tasks(config)
    assert result.program is None
    (found,) = result.diagnostics
    assert (found.code, found.statement, found.span.line) == ("AMX6440", 7, 2)
