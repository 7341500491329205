"""What is a reference in front of what follows it: by unit, and where that says nothing, by name."""

import pytest

from automax_ros.core.types import DataType
from automax_ros.replay.drive_report.line_signals import LineSignal, is_followed


def signal(label, unit, *, is_reference=False, kind=DataType.INTEGER):
    return LineSignal(label, kind, unit, is_reference=is_reference)


@pytest.mark.parametrize(
    ("label", "unit", "others", "expected"),
    [
        ("SPEED_SP%", "fpm", [("SECT%", "fpm")], True),
        ("SPEED_SP%", "fpm", [("SECT%", "rpm")], False),
        ("CUR_REF%", "counts", [("SPEED_FDBK%", "counts")], False),  # 18: it was dotted, and nothing follows it
        ("CUR_REF%", "counts", [("SPEED_FDBK%", "counts"), ("CUR_FB%", "counts")], True),
        ("SPEED_REF%", "", [("SPEED%", "")], True),
        ("CUR_REF%", "", [("CUR_FB%", "A")], False),
    ],
)
def test_by_unit_and_by_name(label, unit, others, expected):
    reference = signal(label, unit, is_reference=True)
    assert is_followed(reference, [reference, *(signal(*other) for other in others)]) is expected


def test_references_and_booleans_follow_nothing():
    reference = signal("SPEED_REF%", "fpm", is_reference=True)
    others = [signal("LINE_REF%", "fpm", is_reference=True), signal("RUN@", "fpm", kind=DataType.BOOLEAN)]
    assert not is_followed(reference, others)
