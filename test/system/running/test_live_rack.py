"""A running rack as a ROS node of another process sees it."""

import math
import signal
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest
from rack.helpers import config_at

from automax_ros.rackfile.model.config import RackConfig
from system.support import TYPES, Automax, Client, consecutive, entries, ns

NS_PER_MS = 1_000_000
PERIODS_NS = {"FAST": 5_500_000, "SLOW": 16_500_000, "COPY": 2_500_000}


@pytest.fixture(scope="module")
def config() -> RackConfig:
    return config_at(TYPES)


@pytest.fixture(scope="module", autouse=True)
def running(module_domain_id) -> Iterator[Automax]:
    """The rack of this module; at the end it has stopped cleanly, whatever was sent to it."""
    with Automax("run", TYPES) as process:
        process.wait_for_line("Ctrl-C ends the run")
        yield process
        ended = process.end(signal.SIGINT)
        assert (ended.code, ended.err) == (0, "")


@pytest.fixture(scope="module")
def shared_client(running) -> Iterator[Client]:
    """A client that has started after all presets were written."""
    with Client() as made:
        yield made


@pytest.fixture
def client(shared_client) -> Iterator[Client]:
    yield shared_client
    shared_client.forget()


def view_of(config: RackConfig, name: str) -> int:
    return [variable.name for variable in config.variables].index(name)


def std(name: str) -> Any:
    import std_msgs.msg

    return getattr(std_msgs.msg, name)


# Late joiners


@pytest.mark.parametrize(
    ("topic", "kind", "value"),
    [
        ("REF", "Int16", 1000),
        ("WIDE_REF", "Int32", -100000),
        ("WIDE_COPY", "Int32", -100000),
        ("GAIN_REF", "Float32", 0.1),
        ("RUN", "Bool", True),
        ("STOPPED", "Bool", False),
        ("NOTE", "String", "ready"),
    ],
)
def test_late_joiner_reads_a_simple_common(client, topic, kind, value):
    message = client.first(std(kind), f"/types/common/{topic}")
    assert message.data == (pytest.approx(value, rel=1e-7) if isinstance(value, float) else value)


@pytest.mark.parametrize(
    ("topic", "kind", "values", "dimensions"),
    [
        ("GRID", "Int16MultiArray", [1, 2, 3, 4, 5, 6], [("subscript1", 2, 6), ("subscript2", 3, 3)]),
        ("LONGS", "Int32MultiArray", [0, 0, 0], [("subscript1", 3, 3)]),
        ("REALS", "Float32MultiArray", [2.5, 2.5], [("subscript1", 2, 2)]),
        ("FLAGS", "UInt8MultiArray", [0, 0, 0, 0], [("subscript1", 4, 4)]),
    ],
)
def test_late_joiner_reads_an_array_with_its_layout(client, topic, kind, values, dimensions):
    message = client.first(std(kind), f"/types/common/{topic}")
    assert list(message.data) == values
    assert [(item.label, item.size, item.stride) for item in message.layout.dim] == dimensions
    assert message.layout.data_offset == 0


def test_late_joiner_reads_what_another_client_set(client):
    seen = client.listen(std("Int32"), "/types/common/WIDE_COPY", latched=True, depth=1)
    client.send(std("Int32"), "/types/common/WIDE_REF/set", std("Int32")(data=2**31 - 1))
    client.until(lambda: bool(seen) and seen[-1].data == 2**31 - 1)
    with Client("second") as second:
        assert second.first(std("Int32"), "/types/common/WIDE_COPY").data == 2**31 - 1


def test_table_describes_every_variable(client, config):
    from automax_msgs.msg import Variable, VariableTable, Writer

    table = client.first(VariableTable, "/types/variables")
    assert table.rack == "TYPES"
    assert [item.id for item in table.variables] == list(range(len(config.variables)))
    assert [item.name for item in table.variables] == [variable.name for variable in config.variables]
    by_name = {item.name: item for item in table.variables}
    reference, grid, hidden = by_name["REF%"], by_name["GRID%"], by_name["HIDDEN%"]
    assert (reference.type, reference.direction, reference.topic) == (
        Variable.INTEGER,
        Variable.IN,
        "/types/common/REF",
    )
    assert (reference.unit, reference.description) == ("counts", "set by the tests")
    assert (list(grid.dimensions), by_name["NOTE$"].length) == ([2, 3], 12)
    assert (hidden.direction, hidden.topic) == (Variable.CLOSED, "")
    assert [name for name, item in by_name.items() if item.non_volatile] == ["COUNT!"]
    writers = {writer.name: (writer.kind, writer.slot) for writer in table.writers}
    assert writers == {
        "rack": (Writer.PRESET, 0),
        "ros": (Writer.ROS, 0),
        "operator": (Writer.OPERATOR, 0),
        "FAST": (Writer.TASK, 1),
        "SLOW": (Writer.TASK, 1),
        "COPY": (Writer.TASK, 2),
    }


def test_late_joiner_follows_memory_from_snapshot_and_backplane(client, config):
    """The image that a joiner gets and the writes after it are the memory: nothing is missing between them."""
    from automax_msgs.msg import CommonImage, CommonWrite

    count = view_of(config, "COUNT!")
    writes = client.listen(CommonWrite, "/types/backplane")
    images = client.listen(CommonImage, "/types/backplane/snapshot", latched=True, depth=1)
    counts = client.listen(std("Int32"), "/types/common/COUNT", latched=True, depth=1)

    def joined() -> bool:
        usable = images and writes and images[-1].sequence >= writes[0].sequence - 1
        return bool(usable) and writes[-1].sequence > images[-1].sequence + 100

    client.until(joined, "a fresh image for the joiner")
    image = images[-1]
    assert ns(image.stamp) > 0
    assert len(image.values.variable) == sum(variable.elements for variable in config.variables)
    memory = {(view, element): value for view, element, value in entries(image.values)}
    assert memory[view_of(config, "REF%"), 0] == 1000
    texts = iter(image.values.text)
    strings = {variable.name: next(texts) for variable in config.variables if variable.length}
    assert strings == {"NOTE$": "ready", "NOTE_COPY$": "ready"}
    newer = [write for write in writes if write.sequence > image.sequence]
    assert consecutive([image.sequence, *(write.sequence for write in newer)])
    seen = [memory[count, 0]]
    for write in newer:
        seen += [value for view, _, value in entries(write.values) if view == count]
    assert consecutive([int(value) for value in seen])
    assert {write.run_id for write in writes} == {image.run_id}
    assert counts[-1].data >= seen[0]


# Writing


def test_written_value_has_its_effect_in_the_next_scan(client, config):
    from automax_msgs.msg import CommonWrite, Scan, VariableTable

    reference, twice = view_of(config, "REF%"), view_of(config, "TWICE%")
    ids = {writer.name: writer.id for writer in client.first(VariableTable, "/types/variables").writers}
    writes = client.listen(CommonWrite, "/types/backplane")
    scans = client.listen(Scan, "/types/scans")
    doubled = client.listen(std("Int16"), "/types/common/TWICE", latched=True, depth=1)
    client.until(lambda: bool(writes and scans and doubled))
    client.send(std("Int16"), "/types/common/REF/set", std("Int16")(data=1234))
    client.until(lambda: doubled[-1].data == 2468)
    client.until(lambda: any((twice, 0, 2468) in entries(write.values) for write in writes))

    assert consecutive([write.sequence for write in writes])
    outside = next(write for write in writes if (reference, 0, 1234) in entries(write.values))
    commit = next(write for write in writes if (twice, 0, 2468) in entries(write.values))
    assert (outside.writer, outside.kind, outside.slot) == (ids["ros"], CommonWrite.OUTSIDE, 0)
    assert (commit.writer, commit.kind, commit.slot) == (ids["FAST"], CommonWrite.COMMIT, 1)
    assert outside.sequence < commit.sequence
    between = [scan for scan in scans if scan.task == "FAST" and ns(outside.stamp) <= ns(scan.stamp)]
    client.until(lambda: any(scan.task == "FAST" and ns(scan.stamp) == ns(commit.stamp) for scan in scans))
    first = between[0] if between else next(scan for scan in scans if ns(scan.stamp) == ns(commit.stamp))
    assert ns(first.stamp) == ns(commit.stamp)
    assert (reference, 0, 1234) in entries(first.latched)
    assert (twice, 0, 2468) in entries(first.committed)


def test_array_is_written_as_a_whole(client):
    grid = client.listen(std("Int16MultiArray"), "/types/common/GRID", latched=True, depth=1)
    last = client.listen(std("Int16"), "/types/common/LAST_GRID", latched=True, depth=1)
    message = std("Int16MultiArray")(data=[9, 8, 7, 6, 5, -4])
    client.send(std("Int16MultiArray"), "/types/common/GRID/set", message)
    client.until(lambda: bool(last) and last[-1].data == -4)
    assert list(grid[-1].data) == [9, 8, 7, 6, 5, -4]


def test_string_is_written(client):
    copies = client.listen(std("String"), "/types/common/NOTE_COPY", latched=True, depth=1)
    client.send(std("String"), "/types/common/NOTE/set", std("String")(data="Grüße"), std("String")(data="ready"))
    client.until(lambda: bool(copies) and copies[-1].data == "ready")


def test_refused_writes_change_nothing_and_are_reported(client, config):
    from automax_msgs.msg import CommonWrite, VariableTable
    from rcl_interfaces.msg import Log

    table = client.first(VariableTable, "/types/variables")
    ros = next(writer.id for writer in table.writers if writer.name == "ros")
    log = client.listen(Log, "/rosout")
    client.until(lambda: client.node.count_publishers("/rosout") >= 3)
    writes = client.listen(CommonWrite, "/types/backplane")
    client.until(lambda: bool(writes))
    refused = {
        "LONGS!": ("Int32MultiArray", {"data": [1, 2]}),
        "REALS": ("Float32MultiArray", {"data": [1.0, math.nan]}),
        "FLAGS@": ("UInt8MultiArray", {"data": [1, 1, 1, 2]}),
        "GAIN_REF": ("Float32", {"data": math.nan}),
        "NOTE$": ("String", {"data": "thirteen char"}),
    }
    for name, (kind, fields) in refused.items():
        topic = f"/types/common/{name.rstrip('!@$')}/set"
        client.send(std(kind), topic, std(kind)(**fields))

    def reported(name: str) -> list[Log]:
        return [entry for entry in log if name in entry.msg and entry.name == "types.common_memory"]

    client.until(lambda: all(reported(name) for name in refused), "a warning for each variable")
    assert {entry.level for name in refused for entry in reported(name)} == {Log.WARN}
    assert "has 3 elements, the message has 2" in reported("LONGS!")[0].msg
    views = {view_of(config, name) for name in refused}
    assert not [write for write in writes if write.writer == ros and views & set(write.values.variable)]
    assert list(client.first(std("Float32MultiArray"), "/types/common/REALS").data) == [2.5, 2.5]
    assert list(client.first(std("UInt8MultiArray"), "/types/common/FLAGS").data) == [0, 0, 0, 0]


def test_only_opened_variables_can_be_written(client, config):
    client.until(lambda: client.node.count_publishers("/types/common/REF") == 1)
    names = {name for name, _ in client.node.get_topic_names_and_types()}
    for variable in config.variables:
        topic = f"/types/common/{variable.name.rstrip('%!@$')}"
        direction = variable.direction.name
        assert client.node.count_subscribers(f"{topic}/set") == (direction == "IN"), variable.name
        assert client.node.count_publishers(topic) == (direction != "CLOSED"), variable.name
        assert (topic in names) == (direction != "CLOSED"), variable.name


def test_rate_limit_holds_back_messages(client, config):
    """4 messages per second of a variable that changes 60 times per second; test_stream.py has the exact times."""
    from automax_msgs.msg import CommonWrite

    writes = client.listen(CommonWrite, "/types/backplane")
    received = client.listen(std("Int32"), "/types/common/CALM")
    client.until(lambda: len(received) >= 5)
    view = view_of(config, "CALM!")
    changes = [write for write in writes if view in write.values.variable]
    assert len(changes) > 2 * len(received)


# Scans


def test_scans_are_consecutive_and_stand_on_the_grid(client):
    from automax_msgs.msg import Scan

    scans = client.listen(Scan, "/types/scans")
    by_task = {name: [] for name in PERIODS_NS}

    def enough() -> bool:
        for scan in scans:
            by_task[scan.task].append(scan)
        scans.clear()
        return all(len(found) >= 60 for found in by_task.values())

    client.until(enough, "60 scans of each task")
    for name, found in by_task.items():
        period = PERIODS_NS[name]
        assert consecutive([scan.scan for scan in found])
        assert {scan.slot for scan in found} == {2 if name == "COPY" else 1}
        for before, after in pairwise(found):
            assert ns(after.stamp) - ns(before.stamp) == period * (1 + after.skipped)
    zero = {(ns(scan.stamp) - ns(by_task["FAST"][0].stamp)) % NS_PER_MS for scan in by_task["COPY"]}
    assert zero <= {0, NS_PER_MS // 2}, "all tasks count from one instant"


# Tunables


@pytest.fixture
def parameters(client):
    from rclpy.parameter_client import AsyncParameterClient

    made = AsyncParameterClient(client.node, "/types/processor_1")
    client.until(made.services_are_ready)
    return made


def test_tunables_are_described(client, parameters):
    from rcl_interfaces.msg import ParameterType

    names = [f"FAST.{name}" for name in ("TRIM", "SLOPE", "FREE", "ANGLE", "RATE")]
    listed = client.result(parameters.list_parameters(["FAST"], 10)).result.names
    assert sorted(listed) == sorted(names)
    values = [client.result(parameters.get_parameters([name])).values[0] for name in names[1:]]
    assert [value.double_value for value in values] == [0.25, 1.5, 0.0, 0.5]
    trim, slope, free, angle, rate = client.result(parameters.describe_parameters(names)).descriptors
    assert trim.type == ParameterType.PARAMETER_INTEGER
    (span,) = trim.integer_range
    assert (span.from_value, span.to_value, span.step) == (-100, 100, 1)
    spans = [item.floating_point_range[0] for item in (slope, free, angle, rate)]
    assert [(item.from_value, item.to_value) for item in (spans[0], *spans[2:])] == [(-1, 1), (-0.3, 0.3), (0, 1)]
    # Only RATE's grid is one that ROS could check: the present value of SLOPE is not on it, FREE's has no bounds,
    # and -0.3 + 3 * 0.1 is not quite 0.
    assert [item.step for item in spans] == [0, 0, 0, 0.25]
    assert "step 0.1" in slope.description


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("TRIM", 101, "range"),
        ("TRIM", 1.5, "type"),
        ("SLOPE", -1.01, "range"),
        ("SLOPE", math.nan, ""),
        ("RATE", 0.6, "step"),
        ("FREE", 1e30, "range"),
    ],
)
def test_wrong_tuning_is_refused_with_a_reason(client, parameters, name, value, reason):
    from rclpy.parameter import Parameter

    before = client.result(parameters.get_parameters([f"FAST.{name}"])).values
    (result,) = client.result(parameters.set_parameters([Parameter(f"FAST.{name}", value=value)])).results
    assert not result.successful
    assert result.reason
    assert reason in result.reason.lower()
    assert client.result(parameters.get_parameters([f"FAST.{name}"])).values == before


def test_tunable_cannot_be_deleted(client, parameters):
    from rclpy.parameter import Parameter

    (result,) = client.result(parameters.set_parameters([Parameter("FAST.TRIM")])).results
    assert not result.successful


def test_tuning_takes_effect_and_is_recorded(client, parameters):
    from automax_msgs.msg import TaskState
    from rclpy.parameter import Parameter

    tuned = client.listen(std("Int16"), "/types/common/TUNED", latched=True, depth=1)
    states = client.listen(TaskState, "/types/states")
    client.until(lambda: bool(tuned) and client.node.count_publishers("/types/states") == 2)
    assert tuned[-1].data == 56  # 10 * 3 + 0.25 * 100 + 1.5
    both = [Parameter("FAST.TRIM", value=-2), Parameter("FAST.SLOPE", value=1.0)]
    results = client.result(parameters.set_parameters(both)).results
    assert [item.successful for item in results] == [True, True]
    client.until(lambda: tuned[-1].data == 81)  # 10 * -2 + 1.0 * 100 + 1.5

    def told() -> bool:
        return any(state.task == "FAST" and state.value[list(state.field).index("TRIM%")] == -2 for state in states)

    client.until(told, "a TaskState with the new value")


def test_tuning_several_at_once_is_all_or_nothing(client, parameters):
    from rclpy.parameter import Parameter

    both = [Parameter("FAST.FREE", value=3.0), Parameter("FAST.RATE", value=7.0)]
    result = client.result(parameters.set_parameters_atomically(both)).result
    assert not result.successful
    assert client.result(parameters.get_parameters(["FAST.FREE"])).values[0].double_value == 1.5


# Health and log


def test_diagnostics_name_every_task(client):
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

    arrays = client.listen(DiagnosticArray, "/diagnostics")
    modules = ("rack: TYPES", "common_memory: 57C413", "processor_1: 57C435", "processor_2: 57C431")
    wanted = {f"types/{part}" for part in (*modules, "processor_1: FAST", "processor_1: SLOW", "processor_2: COPY")}
    client.until(lambda: wanted <= {status.name for array in arrays for status in array.status})
    statuses = [status for array in arrays for status in array.status]
    assert {status.name for status in statuses} == wanted
    for array in arrays:
        assert ns(array.header.stamp) > 0
        assert len({status.name for status in array.status}) == len(array.status) == len(wanted)
    calm = [status for status in statuses if status.name.endswith("FAST")]
    assert {status.level for status in calm} <= {DiagnosticStatus.OK, DiagnosticStatus.WARN}
    for status in calm:
        values = {item.key: item.value for item in status.values}
        assert (values["period_ms"], values["priority"], values["errors"]) == ("5.5", "4", "0")
        assert int(values["scans"]) > 0
        assert status.hardware_id == "TYPES slot 1"
        assert status.message == ("running" if status.level == DiagnosticStatus.OK else status.message)
        assert status.level == DiagnosticStatus.OK or "deadlines missed" in status.message


def test_errors_and_printed_lines_reach_the_log_and_diagnostics(client):
    """A division by 0 in SLOW while GRID%(0,0) is 0, a printed line while it is negative."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from rcl_interfaces.msg import Log

    log = client.listen(Log, "/rosout")
    arrays = client.listen(DiagnosticArray, "/diagnostics")
    kind = std("Int16MultiArray")
    client.send(kind, "/types/common/GRID/set", kind(data=[0] * 6))
    client.until(lambda: any("SLOW" in entry.msg and "AMX7" in entry.msg and "line 240" in entry.msg for entry in log))

    def warned() -> bool:
        slow = [status for array in arrays for status in array.status if status.name.endswith("SLOW")]
        return any(status.level == DiagnosticStatus.WARN and "line 240" in status.message for status in slow)

    client.until(warned)
    client.send(kind, "/types/common/GRID/set", kind(data=[-5] * 6))
    client.until(lambda: any(entry.msg.startswith("SLOW: negative") and "-5" in entry.msg for entry in log))
    client.send(kind, "/types/common/GRID/set", kind(data=[1] * 6))
