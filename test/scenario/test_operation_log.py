"""Operations that services ask for, as the report lists them: with the names that stimuli have."""

import pytest

from automax_ros.rack.base.observers import Operation
from automax_ros.scenario.operation_log import OperationLog


@pytest.mark.parametrize(
    ("operation", "of"),
    [
        (Operation(5, "tune", "SPEED", True, "", "SPEED.KP = 1.2"), "SPEED.KP"),
        (Operation(5, "tune", "SPEED", False, "no such tunable", ""), "SPEED"),
        (Operation(5, "force", "", True, "", "REF% = 3"), "REF%"),
        (Operation(5, "unforce", "", True, "", "REF%"), "REF%"),
        (Operation(5, "reload", "SPEED", True, "", "keep_state"), "SPEED"),
    ],
)
def test_what_an_operation_was_done_to(operation, of):
    log = OperationLog(lambda: False)
    log.operated(operation)
    assert [(item.at_ns, item.what, item.of, item.ok) for item in log.happened] == [
        (5, operation.what, of, operation.ok)
    ]
