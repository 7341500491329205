"""The rack's names as ROS 2 names: valid, visible, and never the same for two things."""

import string

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from automax_ros.core.types import DataType
from automax_ros.rackfile.model.ros_names import namespace, set_topic, topic_names
from automax_ros.rackfile.reading.names import is_rack_name, variable_name

PROPERTY = settings(deadline=None, derandomize=True, database=None, max_examples=300)
FEW = "A_0"  # few letters, so that names often differ in type or underscores only
BARE = st.text(FEW, min_size=1, max_size=5).filter(lambda text: not text[0].isdigit()) | st.text(
    string.ascii_uppercase + string.digits + "_", min_size=1, max_size=16
).filter(lambda text: not text[0].isdigit())
NAMES = st.builds(lambda bare, kind: bare + kind.value, BARE, st.sampled_from(DataType))
RACKS = st.text(string.ascii_uppercase + string.digits, min_size=1, max_size=8)


def test_topic_is_the_name_without_its_type():
    assert topic_names(["LINE_SPEED%", "RUN@", "GAIN"]) == {
        "LINE_SPEED%": "common/LINE_SPEED",
        "RUN@": "common/RUN",
        "GAIN": "common/GAIN",
    }
    assert set_topic("common/RUN") == "common/RUN/set"


def test_names_that_differ_in_type_only_get_its_word():
    assert topic_names(["A%", "A!", "A", "A@", "A$", "B%"]) == {
        "A%": "common/A_int",
        "A!": "common/A_dint",
        "A": "common/A_real",
        "A@": "common/A_bool",
        "A$": "common/A_string",
        "B%": "common/B",
    }


def test_name_that_ros_would_hide_becomes_visible():
    assert topic_names(["_SPARE%"]) == {"_SPARE%": "common/u_SPARE"}


@pytest.mark.parametrize(("rack", "expected"), [("LINE1", "line1"), ("2A", "rack_2a"), ("7", "rack_7")])
def test_namespace(rack, expected):
    assert namespace(rack) == expected


@PROPERTY
@given(st.lists(NAMES, unique=True, max_size=12))
@example(["_A%", "_A@", "A", "A__INT", "A_%", "A_@"])
def test_topics_of_a_rack_differ_and_are_not_hidden(names):
    topics = topic_names(names)
    assert list(topics) == names
    every = [*topics.values(), *(set_topic(topic) for topic in topics.values())]
    assert len(set(every)) == len(every)
    assert not any(part.startswith("_") for topic in every for part in topic.split("/"))


@PROPERTY
@given(st.lists(NAMES, unique=True, max_size=12), RACKS)
@example(["_A%", "_A@", "_", "__!", "A__B", "A_%", "A_@"], "0")
def test_ros_accepts_every_topic_and_namespace(names, rack):
    validation = pytest.importorskip("rclpy.validate_full_topic_name")
    namespaces = pytest.importorskip("rclpy.validate_namespace")
    assert is_rack_name(rack)
    assert all(variable_name(name).name == name for name in names)
    namespaces.validate_namespace(f"/{namespace(rack)}")
    for topic in topic_names(names).values():
        validation.validate_full_topic_name(f"/{namespace(rack)}/{topic}")
        validation.validate_full_topic_name(f"/{namespace(rack)}/{set_topic(topic)}")


@PROPERTY
@given(st.lists(RACKS, unique=True, max_size=20))
def test_racks_of_different_names_have_different_namespaces(racks):
    assert len({namespace(rack) for rack in racks}) == len(racks)
