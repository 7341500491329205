"""launch/rack.launch.py: with launch_ros where it is installed, elsewhere with stand-ins for it."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from automax_ros.cli.shell.arguments import commands
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rackfile.loader import load
from automax_ros.ros.setup.arguments import split_arguments

ROOT = Path(__file__).parents[1]
FILE = ROOT / "launch" / "rack.launch.py"
EXAMPLES = sorted((ROOT / "examples").glob("*/*.launch.py"))
NOT_OPTIONS = {
    "config",
    "mode",
    "namespace",
    "params_file",
    "use_sim_time",
    "log_level",
    "set",
    "on_stop_all",
    "lifecycle",
}
EVENTS = "automax_ros.ros.launch_events"


def kept(name: str):
    return lambda *args, **options: SimpleNamespace(kind=name, args=args, **options)


class Configuration:
    def __init__(self, name):
        self.name = name

    def perform(self, context):
        return context[self.name]


@pytest.fixture
def launch(monkeypatch):
    actions = (
        "DeclareLaunchArgument", "EmitEvent", "IncludeLaunchDescription", "OpaqueFunction", "RegisterEventHandler",
        "Shutdown",
    )  # fmt: skip
    contents = {
        "launch": {"Action": object, "Event": object, "LaunchContext": dict, "LaunchDescription": list},
        "launch.actions": {name: kept(name) for name in actions},
        "launch.event_handler": {"EventHandler": kept("EventHandler")},
        "launch.event_handlers": {"OnProcessIO": kept("OnProcessIO")},
        "launch.events": {"matches_action": lambda action: lambda other: other is action},
        "launch.events.process": {"ProcessIO": object},
        "launch.substitutions": {"LaunchConfiguration": Configuration, "PathJoinSubstitution": kept("path")},
        "launch_ros": {},
        "launch_ros.actions": {"LifecycleNode": kept("LifecycleNode"), "Node": kept("Node")},
        "launch_ros.event_handlers": {"OnStateTransition": kept("OnStateTransition")},
        "launch_ros.events": {},
        "launch_ros.events.lifecycle": {"ChangeState": kept("ChangeState")},
        "launch_ros.substitutions": {"FindPackageShare": kept("share")},
    }
    for name, members in contents.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, EVENTS, raising=False)
    yield lambda file: runpy.run_path(str(file))
    sys.modules.pop(EVENTS, None)


@pytest.fixture
def launch_file(launch) -> dict:
    return launch(FILE)


def declared(launch_file) -> dict[str, str]:
    actions = launch_file["generate_launch_description"]()
    return {item.args[0]: item.default_value for item in actions if item.kind == "DeclareLaunchArgument"}


def started(launch_file, **given) -> list:
    return launch_file["start_rack"]({**declared(launch_file), "config": "rack.yaml", **given})


def node(launch_file, **given) -> SimpleNamespace:
    (found,) = [item for item in started(launch_file, **given) if item.kind == "Node"]
    assert (found.package, found.executable, found.on_exit.kind) == ("automax_ros", "automax", "Shutdown")
    return found


def test_only_what_was_given_is_passed_on(launch_file):
    bare = node(launch_file)
    assert bare.arguments == ["run", "rack.yaml"]
    assert (bare.namespace, bare.parameters, bare.ros_arguments) == (None, None, None)
    given = {
        "mode": "distributed", "allow_outside": "true", "duration": "5", "watch": "A%", "set": "A%=1 N$='a b'",
        "restart": "false", "record": "out", "range": "subnet",
    }  # fmt: skip
    words = node(launch_file, **given).arguments
    assert words[:3] == ["run", "rack.yaml", "--distributed"]
    assert words[-4:] == ["--set", "A%=1", "--set", "N$=a b"]
    assert sorted(words[3:-4]) == sorted(
        ["--no-restart", "--duration", "5", "--record", "out", "--watch", "A%", "--allow-outside", "--range", "subnet"]
    )


def test_what_ros_is_told_goes_the_way_of_ros(launch_file):
    """launch_ros makes --ros-args of it: __ns, parameters, log level."""
    found = node(launch_file, namespace="plant", params_file="p.yaml", use_sim_time="true", log_level="debug")
    assert found.namespace == "plant"
    assert found.parameters == ["p.yaml", {"use_sim_time": True}]
    assert found.ros_arguments == ["--log-level", "debug"]
    assert found.arguments == ["run", "rack.yaml"]


def test_every_option_of_run_is_a_launch_argument_that_names_it(launch_file):
    (run,) = (command for command in commands() if command.words == ("run",))
    flags = {option.names[-1]: option for option in run.options if option.names[-1] != "--help"}
    arguments = declared(launch_file)
    unusual = {"true": "false", "false": "true", "": "5"}
    reached = set()
    for name in arguments.keys() - NOT_OPTIONS:
        words = node(launch_file, **{name: unusual[arguments[name]]}).arguments[2:]
        assert len(words) == 1 + flags[words[0]].takes_value, words
        reached.add(words[0])
    assert reached | {"--distributed", "--set"} == flags.keys()


def test_a_lifecycle_node_is_where_launch_looks_for_it(launch_file):
    """launch_ros asks /NAMESPACE/NAME for its transitions: the rack takes the whole namespace as its own."""
    from lifecycle_msgs.msg import Transition

    rack = str(ROOT / "config" / "section_drive" / "rack.yaml")
    for outer, whole in {"": "pm1", "plant": "plant/pm1", "/plant/": "/plant/pm1"}.items():
        _, node, handler, first = started(launch_file, lifecycle="true", config=rack, namespace=outer)
        assert (node.kind, node.name, node.namespace) == ("LifecycleNode", "rack", whole)
        assert split_arguments(["--ros-args", "-r", f"__ns:=/{whole.strip('/')}"])[1].placed("pm1") == whole.strip("/")
        assert node.arguments == ["run", rack, "--no-autostart"]
        assert first.event.transition_id == Transition.TRANSITION_CONFIGURE
        assert first.event.lifecycle_node_matcher(node)
        (then,) = handler.args
        assert (then.start_state, then.goal_state) == ("configuring", "inactive")
        assert [item.event.transition_id for item in then.entities] == [Transition.TRANSITION_ACTIVATE]
    _, node = started(launch_file, lifecycle="true", autostart="false", config=rack)
    assert node.arguments == ["run", rack, "--no-autostart"]


def test_a_stop_all_is_an_event(launch_file):
    """As `automax run` shows it, one process or many; other lines are not."""
    handler, _ = started(launch_file)
    (told,) = handler.args
    shown = f"{StopCause(0, 'overlap', '14').title}: overlap"
    output = f"rack PM1\n{shown}\nprocessor_1: {shown}\nno STOP ALL today\n".encode()
    for way in (told.on_stdout, told.on_stderr):
        emitted = way(SimpleNamespace(text=output))
        assert [item.event.text for item in emitted] == [shown, f"processor_1: {shown}"]
        assert all(type(item.event).is_event(item.event) for item in emitted)
        assert way(SimpleNamespace(text=b"\xff\n")) == []


def test_a_stop_all_ends_the_launch_where_that_is_wanted(launch_file):
    ends, *_ = started(launch_file, on_stop_all="shutdown")
    (handler,) = ends.args
    (event,) = launch_file["stops_of"](b"STOP ALL: operator\n")
    assert handler.matcher(event)
    assert not handler.matcher(SimpleNamespace())
    assert [item.kind for item in handler.entities] == ["Shutdown"]


def shared(path: SimpleNamespace) -> Path:
    """Where colcon installs a path below share/automax_ros from."""
    share, *parts = path.args[0]
    assert share.args == ("automax_ros",)
    return ROOT.joinpath(*parts)


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_launches_its_rack_and_a_robot_in_its_namespace(launch, file):
    """The rack's namespace is its name in lower case; the robot's own topics stand below its name."""
    rack, robot = launch(file)["generate_launch_description"]()
    assert shared(rack.args[0]) == FILE
    (config,) = [shared(value) for name, value in rack.launch_arguments if name == "config"]
    assert load(config).config.namespace == robot.namespace
    assert robot.executable == sys.executable
    (program,) = map(shared, robot.arguments)
    assert program.parent == file.parent
    assert f'super().__init__("{robot.name}")' in program.read_text(encoding="utf-8")


def test_launch_itself_runs_the_rack(tmp_path, ros_domain_id):
    """Where launch_ros is installed: a rack runs in another namespace, and its end is that of the launch."""
    pytest.importorskip("launch_ros")
    from launch import LaunchDescription, LaunchService
    from launch.actions import IncludeLaunchDescription
    from launch.launch_description_sources import PythonLaunchDescriptionSource

    source = PythonLaunchDescriptionSource(str(FILE))
    given = {"duration": "1", "namespace": "plant", "report": str(tmp_path / "report.json")}
    service = LaunchService()
    service.include_launch_description(
        LaunchDescription([IncludeLaunchDescription(source, launch_arguments=given.items())])
    )
    assert service.run() == 0
    assert (tmp_path / "report.json").is_file()
