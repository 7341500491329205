"""Tunables as ROS parameters: names, and ranges that rclpy accepts."""

import pytest
from rack.helpers import rack_from

from automax_ros.ros.intake.guard import Throttle
from automax_ros.ros.nodes.tunables import Tunable, tunables_of

RACK = """\
rack: LINE1
slots:
  0:
    module: 57C435
    tasks:
      TASK: {priority: 5}
common:
  REF%:
"""


@pytest.fixture
def tunables(tmp_path):
    """The tunables of a task that declares them as given."""

    def made(declared: str) -> list[Tunable]:
        lines = ["10 COMMON REF%", f"20 LOCAL {declared}", "100 CALL SCAN_LOOP(TICKS=2)", "110 REF% = REF%", "120 END"]
        return tunables_of(rack_from(tmp_path, RACK, TASK="\n".join(lines) + "\n").tasks)

    return made


def test_names(tunables):
    found = tunables("GAIN [CURRENT=1.5], GAIN% [CURRENT=2], STEPS! [CURRENT=3]")
    assert {item.variable: item.parameter for item in found} == {
        "GAIN": "TASK.GAIN_real",
        "GAIN%": "TASK.GAIN_int",
        "STEPS!": "TASK.STEPS",
    }


@pytest.mark.parametrize(
    ("declared", "span"),
    [
        ("K [CURRENT=0.5, LOW=0.0, HIGH=1.0, STEP=0.1]", (0.0, 1.0, 0.1)),
        ("K [CURRENT=0.55, LOW=0.0, HIGH=1.0, STEP=0.1]", (0.0, 1.0, 0.0)),  # the present value is off the grid
        ("K [CURRENT=0.5, LOW=0.0, HIGH=0.95, STEP=0.1]", (0.0, 0.95, 0.0)),  # HIGH is
        ("K [CURRENT=0.1, LOW=-0.3, HIGH=0.3, STEP=0.1]", (-0.3, 0.3, 0.0)),  # -0.3 + 3 * 0.1 is not 0
        ("K [CURRENT=1.0, LOW=-1.0, HIGH=1.0, STEP=0.5]", (-1.0, 1.0, 0.5)),
        ("K [CURRENT=0.5, LOW=0.0, HIGH=1.0]", (0.0, 1.0, 0.0)),  # nobody would use the smallest step
        ("K% [CURRENT=5, LOW=-10, HIGH=10, STEP=5]", (-10, 10, 5)),
        ("K% [CURRENT=6, LOW=-10, HIGH=10, STEP=5]", (-10, 10, 1)),
        ("K% [CURRENT=6]", (-32768, 32767, 1)),
        ("K! [CURRENT=6, STEP=2]", (-(2**31), 2**31 - 1, 1)),
    ],
)
def test_range_and_step(tunables, declared, span):
    (tunable,) = tunables(declared)
    descriptor = tunable.descriptor()
    (found,) = descriptor.floating_point_range or descriptor.integer_range
    assert (found.from_value, found.to_value, found.step) == span


@pytest.mark.parametrize(
    ("declared", "values"),
    [
        ("K [CURRENT=0.3, LOW=0.1, HIGH=0.7, STEP=0.1]", [0.1, 0.2, 0.3, 0.4, 0.6, 0.7]),
        ("K [CURRENT=0.0, LOW=-0.3, HIGH=0.3, STEP=0.1]", [-0.3, -0.1, 0.0, 0.2, 0.3]),
        ("K [CURRENT=1.5]", [-9.0e18, 0.0, 1e-10, 9.0e18]),
        ("K [CURRENT=26.7, LOW=5.0, HIGH=80.0, STEP=0.1]", [5.0, 5.1, 33.3, 79.9, 80.0]),
        ("K! [CURRENT=6, STEP=2]", [-(2**31), 0, 2**31 - 1]),
    ],
)
def test_every_value_on_the_grid_is_accepted(ros_domain_id, tunables, declared, values):
    """Rclpy itself judges, and the task agrees with it."""
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.parameter import Parameter

    (tunable,) = tunables(declared)
    context = Context()
    context.init(args=[])
    node = Node("parameters", context=context, enable_rosout=False, start_parameter_services=False)
    try:
        node.declare_parameter(tunable.parameter, tunable.initial, tunable.descriptor())
        for value in values:
            (result,) = node.set_parameters([Parameter(tunable.parameter, value=value)])
            assert result.successful, (value, result.reason)
            tunable.task.tune(tunable.variable, value)
    finally:
        node.destroy_node()
        context.try_shutdown()


def test_throttle_passes_once_an_interval(monkeypatch):
    times = iter([0.0, 0.5, 0.99, 1.0, 1.5, 2.1])
    monkeypatch.setattr("automax_ros.ros.intake.guard.time.monotonic", lambda: next(times))
    throttle = Throttle(1.0)
    assert [throttle.passes() for _ in range(6)] == [True, False, False, True, False, True]
