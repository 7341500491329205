"""Parameters of a command line: read as rcl reads them, for the nodes that rcl means, with their places."""

import itertools
from pathlib import Path

import pytest

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.ros.setup.arguments import split_arguments
from automax_ros.ros.setup.parameter_files import GivenParameter, RosArgumentsError, parameter_of, parameters_of

ROOT = Path(__file__).parents[3]
FILE = """\
/pm1/processor_1:
  ros__parameters:
    LINE: {KP: 1.5, GAIN%: 3}
    use_sim_time: no
    "8": [1, 2]
/plant:
  pm1:
    udc_3:
      ros__parameters: {A.B: "on"}
/**:
  ros__parameters:
    names: [a, "1", 'on']
"""


def read(tmp_path, text):
    path = tmp_path / "params.yaml"
    path.write_text(text)
    return parameters_of(path)


def test_file(tmp_path):
    path = tmp_path / "params.yaml"
    assert read(tmp_path, FILE) == [
        GivenParameter("/pm1/processor_1", "LINE.KP", 1.5, f"{path}:3"),
        GivenParameter("/pm1/processor_1", "LINE.GAIN%", 3, f"{path}:3"),
        GivenParameter("/pm1/processor_1", "use_sim_time", False, f"{path}:4"),
        GivenParameter("/pm1/processor_1", "8", [1, 2], f"{path}:5"),
        GivenParameter("/plant/pm1/udc_3", "A.B", "on", f"{path}:9"),
        GivenParameter("/**", "names", ["a", "1", "on"], f"{path}:12"),
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("/a: 3\n", "1: /a must hold ros__parameters"),
        ("- 3\n", "1: it must hold ros__parameters"),
        ("/a:\n  ros__parameters: 3\n", "2: ros__parameters of /a must be names and values"),
        ("/a:\n  ros__parameters:\n    x: [1, 2.5]\n", "3: a parameter's value is a single value"),
        ("/a:\n  ros__parameters:\n    x: [{y: 1}]\n", "3: a parameter's value is a single value"),
        ("/a:\n  ros__parameters: {x: &here 3}\n", "2: the anchor '&here' is not allowed"),
        ("/a: {\n", "params.yaml:2: "),
    ],
)
def test_wrong_files_are_refused_with_their_line(tmp_path, text, said):
    with pytest.raises(RosArgumentsError) as caught:
        read(tmp_path, text)
    assert said in str(caught.value)


def test_empty_file_gives_nothing(tmp_path):
    assert read(tmp_path, "") == []


def test_a_pipe_is_not_read(tmp_path):
    import os

    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RosArgumentsError, match="not a regular file"):
        parameters_of(tmp_path / "pipe")


@pytest.mark.parametrize(
    ("rule", "key", "name", "value"),
    [
        ("LINE.KP:=1.5", "/**", "LINE.KP", 1.5),
        ("processor_1:LINE.KP:=-2", "processor_1", "LINE.KP", -2),
        ("/pm1/processor_1:use_sim_time:=true", "/pm1/processor_1", "use_sim_time", True),
        ("a:='1'", "/**", "a", "1"),
        ("a:=[true, off]", "/**", "a", [True, False]),
        ("a:=x:=y", "/**", "a", "x:=y"),
    ],
)
def test_rule(rule, key, name, value):
    found = parameter_of(rule)
    assert (found.key, found.name, found.value) == (key, name, value)
    assert type(found.value) is type(value)


SCALARS = (
    *("1", "-7", "0x1F", "-0x1f", "010", "-017", "08", "0", "-0", "99999999999"),
    *("1.5", ".5", "1.", "1e3", "-2E-3", ".inf", "-.Inf", ".nan"),
    *("true", "Off", "YES", "n", "on", "'on'", '"3"', "abc", "1_0", "1:30", "~"),
)


def test_values_are_those_that_rcl_gives_a_node(ros_domain_id):
    """Rclpy itself is asked for each of them."""
    from rclpy.context import Context
    from rclpy.node import Node

    words = ["--ros-args"]
    for number, text in enumerate(SCALARS):
        words += ["-p", f"v{number}:={text}"]
    _, arguments = split_arguments(words, {})
    context = Context()
    context.init(args=arguments.words)
    node = Node(
        "params",
        context=context,
        enable_rosout=False,
        start_parameter_services=False,
        automatically_declare_parameters_from_overrides=True,
    )
    try:
        for number, (text, mine) in enumerate(zip(SCALARS, arguments.parameters, strict=True)):
            if mine.value is None:
                continue  # rcl has no nothing
            value = node.get_parameter(f"v{number}").value
            assert type(value) is type(mine.value), text
            assert repr(value) == repr(mine.value), text
    finally:
        node.destroy_node()
        context.try_shutdown()


@pytest.mark.parametrize(
    ("key", "node", "meant"),
    [
        ("/**", "/pm1/rack", True),
        ("/*", "/rack", True),
        ("/*", "/pm1/rack", False),
        ("/*/rack", "/pm1/rack", True),
        ("/**/rack", "/a/b/rack", True),
        ("/**/rack", "/rack", True),
        ("/pm1/**", "/pm1/rack", True),
        ("/pm1/**", "/pm2/rack", False),
        ("/pm1/rack", "/pm1/rack", True),
        ("/pm1/rack", "/plant/pm1/rack", False),
        ("rack", "/plant/pm1/rack", True),
        ("pm1/rack", "/plant/pm1/rack", True),
        ("ack", "/pm1/rack", False),
        ("/pm1/r.ck", "/pm1/rack", False),
    ],
)
def test_which_nodes_a_key_means(key, node, meant):
    assert GivenParameter(key, "x", 1, "").means(node) is meant


def meets(keys, parts):
    """A model without regular expressions: ** is tried with every number of parts."""
    if not keys:
        return not parts
    if keys[0] == "**":
        return any(meets(keys[1:], parts[taken:]) for taken in range(len(parts) + 1))
    return bool(parts) and keys[0] in ("*", parts[0]) and meets(keys[1:], parts[1:])


def test_wildcards_against_a_model():
    """All patterns of up to four parts, all names of up to three."""
    nodes = [parts for count in (1, 2, 3) for parts in itertools.product("ab", repeat=count)]
    for count in (1, 2, 3, 4):
        for keys in itertools.product(("a", "b", "*", "**"), repeat=count):
            pattern = GivenParameter("/" + "/".join(keys), "x", 1, "")
            assert [pattern.means("/" + "/".join(parts)) for parts in nodes] == [meets(keys, parts) for parts in nodes]


def test_main_node_is_also_what_launch_calls_the_program():
    _, ros = split_arguments(
        [
            "--ros-args",
            "-r",
            "__ns:=/plant",
            "-r",
            "__node:=line",
            "-p",
            "/plant/line:A:=1",
            "-p",
            "/plant/pm1/line:B:=2",
        ],
        {},
    )
    assert {name: item.value for name, item in ros.given_to("rack", "plant/pm1", main=True).items()} == {"A": 1, "B": 2}
    assert ros.given_to("processor_1", "plant/pm1") == {}


def test_the_last_one_counts(tmp_path):
    path = tmp_path / "p.yaml"
    path.write_text("/**: {ros__parameters: {A: 2}}\n")
    rules = {"-p": "A:=1", "--params-file": str(path)}
    for first, second in itertools.permutations(rules):
        _, ros = split_arguments(["--ros-args", first, rules[first], second, rules[second]], {})
        assert ros.given_to("x", "pm1")["A"].value == (2 if second == "--params-file" else 1)


def test_file_of_the_page(tmp_path):
    """The example of docs/ros.md names a tunable of the section drive, and a value that its task takes."""
    page = (ROOT / "docs" / "ros.md").read_text(encoding="utf-8")
    example = page.partition("<!-- run by test/ros/setup/test_ros_parameters.py -->\n```yaml\n")[2].partition("```")[0]
    (found,) = read(tmp_path, example)
    rack = Rack(load(ROOT / "config" / "section_drive" / "rack.yaml").config)
    task, _, name = found.name.partition(".")
    assert found.key == f"/{rack.config.namespace}/processor_{rack.task(task).slot}"
    assert rack.task(task).tuning(name, found.value) == found.value
