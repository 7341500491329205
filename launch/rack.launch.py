"""Start one rack: ros2 launch automax_ros rack.launch.py [config:=FILE] [mode:=distributed] [namespace:=plant] ...

Every option of `automax run` is a launch argument; `ros2 launch automax_ros rack.launch.py --show-args` lists them.
PushRosNamespace, SetParameter and SetRemap of a launch file that includes this one hold for the rack's nodes. A
STOP ALL is the event `RackStopped` (automax_ros/ros/launch_events.py); the end of the rack ends the launch. With
lifecycle:=true the rack is a LifecycleNode, which this file configures and activates unless autostart:=false, and which
heeds ChangeState of others.
"""

import shlex
from pathlib import Path
from typing import Any

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler, Shutdown
from launch.event_handler import EventHandler
from launch.event_handlers import OnProcessIO
from launch.events import matches_action
from launch.events.process import ProcessIO
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import LifecycleNode, Node
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.substitutions import FindPackageShare
from lifecycle_msgs.msg import Transition

from automax_ros.cli.shell.arguments import Option, commands
from automax_ros.rackfile.loader import load
from automax_ros.ros.launch_events import RackStopped, stops_of

PACKAGE = "automax_ros"
YES_NO = ["true", "false"]
NEGATED = "--no-"
"""An option `--no-restart` is the argument `restart`, true unless somebody says false."""
AWAITS = "--no-autostart"
"""What lets the rack wait for a lifecycle manager."""
OTHERWISE = {"--help", "--distributed", "--set"}
"""Options that are not an argument of their own name and kind."""


def run_options() -> list[Option]:
    """The options of `automax run` that are launch arguments as they stand."""
    (run,) = (command for command in commands() if command.words == ("run",))
    return [option for option in run.options if option.names[-1] not in OTHERWISE]


def name_of(option: Option) -> str:
    """The launch argument of an option."""
    return option.names[-1].removeprefix(NEGATED).removeprefix("--").replace("-", "_")


def usual(option: Option) -> str:
    """What the launch argument is until somebody says more: false or true for a switch, else empty."""
    return "" if option.takes_value else str(option.names[-1].startswith(NEGATED)).lower()


def argument_of(option: Option) -> DeclareLaunchArgument:
    """The declaration of an option's launch argument."""
    words = ["", *option.values] if option.values else []
    choices = words if option.takes_value else YES_NO
    return DeclareLaunchArgument(
        name_of(option), default_value=usual(option), choices=choices or None, description=option.text
    )


def words_of(context: LaunchContext) -> list[str]:
    """The command line after `automax`; what was not given is left to the program's own default."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    words = ["run", value("config")]
    if value("mode") == "distributed":
        words.append("--distributed")
    for option in run_options():
        given, flag = value(name_of(option)), option.names[-1]
        if given != usual(option):
            words += [flag, given] if option.takes_value else [flag]
    for setting in shlex.split(value("set")):
        words += ["--set", setting]
    return words


def whole_namespace(outer: str, config: str) -> str:
    """The namespace of the node `rack`: that which was given, and the rack's own, also where its file has errors."""
    path = Path(config)
    own = load(path / "rack.yaml" if path.is_dir() else path, allow_outside=True).namespace
    return "/".join(filter(None, (outer.rstrip("/"), own)))


def autostart(rack: LifecycleNode) -> list[Action]:
    """What configures the rack as soon as it is there, and activates it then."""

    def ask(transition: int) -> EmitEvent:
        return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(rack), transition_id=transition))

    is_configured = OnStateTransition(
        target_lifecycle_node=rack,
        start_state="configuring",
        goal_state="inactive",
        entities=[ask(Transition.TRANSITION_ACTIVATE)],
    )
    return [RegisterEventHandler(is_configured), ask(Transition.TRANSITION_CONFIGURE)]


def tell_stops(event: ProcessIO) -> list[Action]:
    """An event for each STOP ALL in what the rack has printed."""
    return [EmitEvent(event=stop) for stop in stops_of(event.text)]


def start_rack(context: LaunchContext) -> list[Action]:
    """The rack as one node, and what happens when it stops."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    parameters = [value("params_file")] if value("params_file") else []
    if value("use_sim_time") == "true":
        parameters.append({"use_sim_time": True})
    words, is_managed = words_of(context), value("lifecycle") == "true"
    node: dict[str, Any] = {
        "package": PACKAGE,
        "executable": "automax",
        "arguments": [*words, AWAITS] if is_managed and AWAITS not in words else words,
        "namespace": value("namespace") or None,
        "parameters": parameters or None,
        "ros_arguments": ["--log-level", value("log_level")] if value("log_level") else None,
        "output": "screen",
        "on_exit": Shutdown(reason="the rack has ended"),
    }
    if is_managed:
        node |= {"name": "rack", "namespace": whole_namespace(value("namespace"), value("config"))}
    rack = LifecycleNode(**node) if is_managed else Node(**node)
    told = OnProcessIO(target_action=rack, on_stdout=tell_stops, on_stderr=tell_stops)
    actions: list[Action] = [RegisterEventHandler(told), rack]
    if is_managed and AWAITS not in words:
        actions += autostart(rack)
    if value("on_stop_all") == "shutdown":
        end = Shutdown(reason="the rack's tasks were stopped")
        actions.insert(0, RegisterEventHandler(EventHandler(matcher=RackStopped.is_event, entities=[end])))
    return actions


def generate_launch_description() -> LaunchDescription:
    """The launch arguments, then the rack."""
    example = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "section_drive", "rack.yaml"])
    texts = {
        "namespace": "ROS namespace that the rack's own goes into, such as plant for /plant/pm1",
        "params_file": "parameters of the rack's nodes: tunables TASK.NAME; empty: none",
        "log_level": "log level of the rack's nodes, such as debug or rclpy:=warn; empty: info",
        "set": "common variables to write first, such as 'REF%=5 RUN@=1'",
    }
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=example, description="rack YAML file"),
            DeclareLaunchArgument(
                "mode",
                default_value="composed",
                choices=["composed", "distributed"],
                description="composed: one process; distributed: each module in a process of its own",
            ),
            DeclareLaunchArgument(
                "use_sim_time", default_value="false", choices=YES_NO, description="follow /clock, scan by scan"
            ),
            DeclareLaunchArgument(
                "lifecycle",
                default_value="false",
                choices=YES_NO,
                description="a LifecycleNode of launch_ros, whose transitions launch knows and asks for",
            ),
            DeclareLaunchArgument(
                "on_stop_all",
                default_value="keep",
                choices=["keep", "shutdown"],
                description="what a STOP ALL does to the launch: the nodes stay to be looked at, or all ends",
            ),
            *(DeclareLaunchArgument(name, default_value="", description=text) for name, text in texts.items()),
            *(argument_of(option) for option in run_options()),
            OpaqueFunction(function=start_rack),
        ]
    )
