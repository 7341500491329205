"""launch/rack.launch.py without ROS's launch packages: stand-ins keep what the file makes of them."""

import argparse
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from automax_ros.cli import run

FILE = Path(__file__).parent.parent / "launch" / "rack.launch.py"


def kept(name: str):
    return lambda *args, **options: SimpleNamespace(kind=name, args=args, **options)


class Configuration:
    def __init__(self, name):
        self.name = name

    def perform(self, context):
        return context[self.name]


@pytest.fixture
def launch_file(monkeypatch) -> dict:
    contents = {
        "launch": {"LaunchContext": dict, "LaunchDescription": list},
        "launch.actions": {
            name: kept(name) for name in ("DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction", "Shutdown")
        },
        "launch.substitutions": {"LaunchConfiguration": Configuration, "PathJoinSubstitution": kept("path")},
        "launch_ros": {},
        "launch_ros.substitutions": {"ExecutableInPackage": kept("executable"), "FindPackageShare": kept("share")},
    }
    for name, members in contents.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
    return runpy.run_path(str(FILE))


def declared(launch_file) -> dict[str, str]:
    actions = launch_file["generate_launch_description"]()
    return {item.args[0]: item.default_value for item in actions if item.kind == "DeclareLaunchArgument"}


def command(launch_file, **given) -> list:
    (process,) = launch_file["start_rack"]({**declared(launch_file), **given})
    assert process.on_exit.kind == "Shutdown"
    return process.cmd[1:]


def test_only_what_was_given_is_passed_on(launch_file):
    assert command(launch_file, config="rack.yaml") == ["run", "rack.yaml"]
    given = {"simulated": "true", "allow_outside": "true", "duration": "5", "watch": "A%", "set": "A%=1 N$='a b'"}
    assert command(launch_file, config="rack.yaml", **given) == [
        "run", "rack.yaml", "--simulated", "--allow-outside", "--duration", "5", "--watch", "A%",
        "--set", "A%=1", "--set", "N$=a b",
    ]  # fmt: skip


def test_every_option_of_run_is_a_launch_argument(launch_file):
    parser = argparse.ArgumentParser(add_help=False)
    run.add_arguments(parser)
    options = {
        action.option_strings[0].removeprefix("--").replace("-", "_")
        for action in parser._actions
        if action.option_strings
    }
    assert declared(launch_file).keys() == options | {"config"}
