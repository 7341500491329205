"""What stands after --ros-args: what is ours to read, what goes on to rcl, and what neither takes."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.ros.setup.arguments import LONGEST_WORD, RosArgumentsError, split_arguments
from automax_ros.ros.setup.discovery import choose_range, range_text


def split(text, **environ):
    return split_arguments(text.split(), environ)


def test_arguments_of_ros_may_stand_anywhere_and_more_than_once():
    words, ros = split("run --ros-args -p a.b:=1 -- rack.yaml --duration 3 --ros-args --log-level debug")
    assert words == ["run", "rack.yaml", "--duration", "3"]
    assert ros.rules == (("--param", "a.b:=1"), ("--log-level", "debug"))
    assert ros.given


def test_two_dashes_outside_of_them_stay():
    words, ros = split("record -- PM1")
    assert words == ["record", "--", "PM1"]
    assert not ros.given


def test_the_word_alone_gives_nothing():
    words, ros = split("check rack.yaml --ros-args")
    assert words == ["check", "rack.yaml"]
    assert not ros.given
    assert ros.words == ["--ros-args", "--disable-stdout-logs"]


def test_namespace_is_where_the_racks_own_goes_into():
    _, ros = split("run --ros-args -r __ns:=/plant/area_1")
    assert ros.placed("pm1") == "plant/area_1/pm1"
    assert ros.rules == ()


@pytest.mark.parametrize(
    ("text", "placed"),
    [
        ("/plant", "plant/pm1"),
        ("plant/", "plant/pm1"),
        ("/", "pm1"),
        ("", "pm1"),
        ("/pm1", "pm1"),
        ("/plant/pm1", "plant/pm1"),
        ("/xpm1", "xpm1/pm1"),
        ("/pm1/plant", "pm1/plant/pm1"),
    ],
)
def test_namespace_of_the_environment(text, placed):
    assert split("run", ROS_NAMESPACE=text)[1].placed("pm1") == placed


def test_arguments_come_before_the_environment():
    assert split("run --ros-args --remap __ns:=/a", ROS_NAMESPACE="/b")[1].placed("pm1") == "a/pm1"


def test_names_of_nodes():
    _, ros = split("run --ros-args -r __node:=line -r processor_1:__node:=cpu -r operator:__name:=desk")
    assert ros.name_of("rack", main=True) == "line"
    assert ros.name_of("processor_1") == "cpu"
    assert ros.name_of("operator") == "desk"
    assert ros.name_of("processor_2") == "processor_2"
    assert ros.rules == ()


def test_another_program_can_be_told_the_same(tmp_path):
    path = tmp_path / "p.yaml"
    path.write_text("/**: {ros__parameters: {A: 2}}\n")
    words = ["--ros-args", "-r", "__ns:=/plant/a", "-r", "__node:=line", "-r", "udc_3:__node:=drive", "-p", "A:=1"]
    words += [
        "-r",
        "common/A:=/x",
        "--enable-rosout-logs",
        "--",
        "--ros-args",
        "--params-file",
        str(tmp_path / "p.yaml"),
    ]
    _, given = split_arguments(words, {})
    assert split_arguments(given.command_line, {"ROS_NAMESPACE": "other"}) == ([], given)
    assert split_arguments([], {})[1].command_line == []


def test_remaps_of_topics_go_on_to_rcl():
    _, ros = split("run --ros-args -r common/REF:=/x/ref -r processor_1:scans:=/x/scans")
    assert ros.words[2:] == ["--remap", "common/REF:=/x/ref", "--remap", "processor_1:scans:=/x/scans"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("-r", "-r needs a value"),
        ("--params-file", "--params-file needs a value"),
        ("--log-levle debug", "did you mean --log-level?"),
        ("a:=b", "-r renames, -p sets a parameter"),
        ("-r __ns:=plant", "'plant' is not a namespace"),
        ("-r __ns:=/a//b", "'/a//b' is not a namespace"),
        ("-r __ns:=/../x", "is not a namespace"),
        ("-r __node:=a/b", "'a/b' is not the name of a node"),
        ("-r __node:=", "'' is not the name of a node"),
        ("-r processor_1:__ns:=/x", "the nodes share one namespace"),
        ("-p LINE.KP", "not NAME:=VALUE or NODE:NAME:=VALUE"),
        ("-p use_sim_time:=maybe", "use_sim_time is true or false"),
        ("-p processor_1:start_type_description_service:=5", "start_type_description_service is true or false"),
        ("-p LINE.KP:=[1", "-p LINE.KP:=[1:1: "),
        ("--params-file /nonexistent.yaml", "/nonexistent.yaml: cannot be read: No such file"),
        ("-p " + "x" * (LONGEST_WORD + 1), "more than 1000 words"),
    ],
)
def test_wrong_ones_are_refused_with_the_reason(text, said):
    with pytest.raises(RosArgumentsError) as caught:
        split(f"run --ros-args {text}")
    assert said in str(caught.value)


def test_wrong_namespace_of_the_environment_is_refused():
    with pytest.raises(RosArgumentsError, match="ROS_NAMESPACE: 'a b' is not a namespace"):
        split("run", ROS_NAMESPACE="a b")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("-p LINE..KP:=", "Couldn't parse parameter override rule"),
        ("-r common/REF:=a//b", "Couldn't parse remap rule"),
        ("--log-level loud", "Couldn't parse log level"),
    ],
)
def test_what_rcl_refuses(text, said):
    with pytest.raises(RosArgumentsError) as caught:
        split(f"run --ros-args {text}")[1].checked()
    assert said in str(caught.value)
    assert "/src/" not in str(caught.value)


@settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.text(alphabet="-rp_:=/aZ.", max_size=8), max_size=12))
def test_any_words_are_taken_or_refused(words):
    """What is left is what stood outside, in its order."""
    try:
        left, ros = split_arguments(["x", "--ros-args", *words], {})
    except RosArgumentsError:
        return
    end = words.index("--") if "--" in words else len(words)
    assert left == ["x", *words[end + 1 :]]
    assert ros.given == (end > 0)


@pytest.mark.parametrize(
    ("chosen", "environment", "told"),
    [
        (None, {}, "this host"),
        (None, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "the whole subnet"),
        (None, {"ROS_STATIC_PEERS": "10.0.0.5;10.0.0.6"}, "this host and 10.0.0.5, 10.0.0.6"),
        (None, {"ROS_LOCALHOST_ONLY": "1"}, "this host (ROS_LOCALHOST_ONLY)"),
        ("subnet", {}, "the whole subnet"),
        ("subnet", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_LOCALHOST_ONLY": "1"}, "the whole subnet"),
        ("off", {"ROS_STATIC_PEERS": "10.0.0.5"}, "nobody"),
        ("localhost", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "this host"),
    ],
)
def test_discovery_range(monkeypatch, chosen, environment, told):
    for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    choose_range(chosen)
    assert range_text() == told
