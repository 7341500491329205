"""A rack that begins with what the command line gives its tunables; what reaches nobody is told."""

from pathlib import Path

import pytest
from system.support import TYPES

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.ros.setup.arguments import split_arguments
from automax_ros.ros.setup.parameter_files import RosArgumentsError
from ros.intake.test_service_requests import answer, parameter
from ros.support import until


@pytest.fixture
def started(ros_domain_id):
    """A live rack with ROS arguments, and after them those with which a second one begins."""
    from automax_ros.ros.live_rack import LiveRack

    lives: list[LiveRack] = []

    def start(*words, rack=None, **environ):
        _, arguments = split_arguments(["--ros-args", *words], environ)
        rack = Rack(load(TYPES).config) if rack is None else rack
        lives.append(LiveRack(rack, arguments.checked()))
        lives[-1].start([])
        return lives[-1]

    yield start
    for live in lives:
        live.close()


def fast(live, name):
    return live.rack.task("FAST").value(name)


def test_tunables_have_the_values_given(started, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text("/types/processor_1: {ros__parameters: {FAST: {TRIM: 7, SLOPE: 0.5}}}\n")
    live = started("--params-file", str(path), "-p", "processor_1:FAST.SLOPE:=0.6", "-p", "FAST.FREE:=2")
    assert (fast(live, "TRIM%"), fast(live, "SLOPE"), fast(live, "FREE")) == (7, pytest.approx(0.6), 2.0)
    assert live.notes == []
    (node,) = [node for node in live.nodes.nodes if node.get_name() == "processor_1"]
    assert node.get_parameter("FAST.TRIM").value == 7
    assert node.get_parameter("FAST.FREE").value == 2.0


def test_they_are_recorded_with_the_states_at_the_start(started):
    """What a recording begins with has them, as after a power-up."""
    from automax_ros.messages.cdr.cdr import decode

    states = []
    live = started("-p", "FAST.TRIM:=7")
    live.stream.add_sink(
        lambda topic: (
            (lambda _, data: states.append(decode(topic.type_name, data))) if topic.name == "/types/states" else None
        )
    )
    live.stream.send_states(1)
    (state,) = [item for item in states if item.task == "FAST"]
    assert "TRIM%" in str(state)


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ("FAST.TRIM:=101", "-p FAST.TRIM:=101: FAST.TRIM: "),
        ("FAST.TRIM:=1.5", "-p FAST.TRIM:=1.5: FAST.TRIM: "),
        ("FAST.SLOPE:=fast", "-p FAST.SLOPE:=fast: FAST.SLOPE: "),
        ("FAST.SLOPE:=[0.1]", "FAST.SLOPE: "),
        ("FAST.SLOPE:=.nan", "FAST.SLOPE: "),
    ],
)
def test_what_a_task_refuses_keeps_the_rack_from_starting(started, rule, said):
    with pytest.raises(RosArgumentsError) as caught:
        started("-p", rule)
    assert str(caught.value).startswith(said) or said in str(caught.value)
    assert len(str(caught.value)) > len(said) + 5


def test_node_rack_stands_for_all_tunables_and_launch_names_it(started, tmp_path):
    """What launch_ros writes for a Node with a name and a namespace."""
    path = tmp_path / "launch.yaml"
    path.write_text("/plant/line: {ros__parameters: {FAST.TRIM: 9}}\n")
    live = started("-r", "__ns:=/plant", "-r", "__node:=line", "--params-file", str(path), "-p", "line:FAST.FREE:=1.0")
    assert (fast(live, "TRIM%"), fast(live, "FREE")) == (9, 1.0)
    assert live.notes == []


def test_key_of_a_file_that_no_node_has_is_told_with_its_line(started, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text("/types/procesor_1:\n  ros__parameters:\n    FAST.TRIM: 9\n    FAST.FREE: 1.0\n")
    live = started("--params-file", str(path))
    assert live.notes == [f"{path}:3: the rack has no node '/types/procesor_1': did you mean /types/processor_1?"]
    assert fast(live, "TRIM%") == 3


@pytest.mark.parametrize(
    ("rule", "told"),
    [
        ("procesor_1:FAST.TRIM:=1", "the rack has no node 'procesor_1': did you mean processor_1?"),
        ("processor_1:FAST.TRIMM:=1", "processor_1 has no parameter 'FAST.TRIMM': did you mean FAST.TRIM?"),
        ("FAST.TRIMM:=1", "the rack has no parameter 'FAST.TRIMM': did you mean FAST.TRIM?"),
        ("processor_2:FAST.TRIM:=1", "processor_2 has no parameter 'FAST.TRIM': processor_1 has it"),
        ("robot_speed:=1", None),
        ("use_sim_time:=false", None),
        ("processor_1:use_sim_time:=false", None),
        ("rack:FAST.TRIM:=1", None),
        ("udc_3:use_sim_time:=true", "use_sim_time is for a whole rack: give it to all nodes, or to the node rack"),
    ],
)
def test_what_reaches_nobody_is_told_once(started, rule, told):
    live = started("-p", rule, "-p", rule)
    assert live.notes == ([f"-p {rule}: {told}"] if told else [])


def test_what_param_dump_prints_gives_the_same_rack(started, tmp_path, client):
    """The services that `ros2 param dump` calls, its YAML, and a second rack that begins with it."""
    import yaml
    from rcl_interfaces.srv import GetParameters, ListParameters
    from rclpy.parameter import Parameter

    live = started("-p", "FAST.TRIM:=-4", "-p", "FAST.RATE:=0.75")
    names = answer(
        live, client, ListParameters, "/types/processor_1/list_parameters", ListParameters.Request()
    ).result.names
    values = answer(
        live, client, GetParameters, "/types/processor_1/get_parameters", GetParameters.Request(names=names)
    ).values
    dumped = {}
    for name, value in zip(names, values, strict=True):
        at = dumped
        *path, last = name.split(".")
        for part in path:
            at = at.setdefault(part, {})
        at[last] = Parameter.from_parameter_msg(type("P", (), {"name": name, "value": value})()).value
    path = Path(tmp_path / "dump.yaml")
    path.write_text(yaml.safe_dump({"/types/processor_1": {"ros__parameters": dumped}}))
    live.close()
    again = started("--params-file", str(path))
    assert (fast(again, "TRIM%"), fast(again, "RATE")) == (-4, 0.75)
    assert again.notes == []
    assert {name: fast(again, name) for name in ("SLOPE", "FREE", "ANGLE")} == {
        name: fast(live, name) for name in ("SLOPE", "FREE", "ANGLE")
    }


def test_reasons_name_what_is_near_and_facts_cannot_be_set(started, client):
    from rcl_interfaces.srv import SetParameters

    live = started()
    wrong = [
        parameter("FAST.TRIMM", 2, integer_value=3),
        parameter("model", 4, string_value="57C430"),
        parameter("FAST.TRIM", 2, integer_value=3),
    ]
    found = answer(
        live, client, SetParameters, "/types/processor_1/set_parameters", SetParameters.Request(parameters=wrong)
    )
    assert [result.successful for result in found.results] == [False, False, True]
    assert found.results[0].reason == "processor_1 has no parameter 'FAST.TRIMM': did you mean FAST.TRIM?"
    assert "read-only" in found.results[1].reason.lower() or "read only" in found.results[1].reason.lower()


def test_parameters_follow_whoever_tunes_otherwise(started):
    live = started()
    (node,) = [node for node in live.nodes.nodes if node.get_name() == "processor_1"]
    live.rack.adjust.tune("FAST.TRIM%", 42)
    assert node.get_parameter("FAST.TRIM").value == 42
    assert fast(live, "TRIM%") == 42


def test_facts_of_rack_and_module(started):
    live = started()
    nodes = {node.get_name(): node for node in live.nodes.nodes}
    facts = {
        name: nodes["common_memory"].get_parameter(name).value for name in ("rack", "run_id", "config", "executive")
    }
    assert facts == {"rack": "TYPES", "run_id": live.stream.run_id, "config": str(TYPES), "executive": "4.2"}
    assert nodes["processor_1"].get_parameter("tick_ms").value == 5.5
    assert nodes["processor_1"].get_parameter("slot").value == 1


def test_value_of_the_command_line_counts_more_than_the_kept_one(started):
    rack = Rack(load(TYPES).config)
    rack.task("FAST").tune("TRIM%", 11)
    rack.task("FAST").tune("FREE", 3.5)
    live = started("-p", "FAST.TRIM:=12", rack=rack)
    assert (fast(live, "TRIM%"), fast(live, "FREE")) == (12, 3.5)


def test_topics_are_renamed_and_nodes_named(started, client):
    from std_msgs.msg import Int16

    live = started("-r", "common/TWICE:=/robot/speed", "-r", "processor_1:__node:=cpu")
    heard = client.listen(Int16, "/robot/speed", latched=True)
    until(live, client, lambda: heard)
    until(live, client, lambda: ("cpu", "/types") in client.node.get_node_names_and_namespaces())
    assert "/types/common/TWICE" not in dict(client.node.get_topic_names_and_types())
