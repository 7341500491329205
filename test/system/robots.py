"""A robot of examples/ as a child process, and what its layouts for Foxglove and PlotJuggler show."""

import importlib.util
import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

from system.support import PATIENCE_S, ROOT

EXAMPLES = ROOT / "examples"
JOINT_FIELDS = {"position", "velocity", "effort"}


def module_of(path: Path) -> ModuleType:
    """A program of examples/ as a module."""
    spec = importlib.util.spec_from_file_location(f"example_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


class Robot:
    """A robot's program with arguments for ROS, in a ``with`` block that ends it with Ctrl-C."""

    def __init__(self, program: Path, *ros_arguments: str) -> None:
        command = [sys.executable, str(program), "--ros-args", *ros_arguments]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT)

    def __enter__(self) -> "Robot":
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.terminate()
        self._process.communicate(timeout=PATIENCE_S)

    def end(self) -> tuple[int, str]:
        """Press Ctrl-C and return the exit code and what stands on standard error."""
        self._process.send_signal(signal.SIGINT)
        _, err = self._process.communicate(timeout=PATIENCE_S)
        return self._process.returncode, err


def shown(folder: Path) -> dict[str, set[str]]:
    """The topics that the layouts of an example name, each with the fields that they show, in Foxglove's spelling."""
    found: dict[str, set[str]] = {}
    for topic, field in (*_foxglove(json.loads((folder / "foxglove.json").read_text())), *_plotjuggler(folder)):
        found.setdefault(topic, set()).add(field)
    return found


def published(folder: Path) -> dict[str, tuple[str, str]]:
    """What the buttons of the Foxglove layout send: topic to type and message as JSON."""
    panels = json.loads((folder / "foxglove.json").read_text())["configById"].values()
    return {panel["topicName"]: (panel["datatype"], panel["value"]) for panel in panels if "topicName" in panel}


def _foxglove(layout: dict) -> Iterator[tuple[str, str]]:
    panels = layout["configById"]
    assert sorted(_leaves(layout["layout"])) == sorted(panels), "each panel has a place"
    for panel in panels.values():
        for path in [*(item["value"] for item in panel.get("paths", ())), *filter(None, [panel.get("path")])]:
            topic, _, field = path.partition(".")
            yield topic, re.sub(r"\[\d+\]", "[]", field)
        if "topicToRender" in panel:
            yield panel["topicToRender"], "status"


def _leaves(part: str | dict) -> list[str]:
    return [part] if isinstance(part, str) else [*_leaves(part["first"]), *_leaves(part["second"])]


def _plotjuggler(folder: Path) -> Iterator[tuple[str, str]]:
    """Curves: topic and fields with slashes; a joint's stand under its name."""
    root = ElementTree.parse(folder / "plotjuggler.xml").getroot()
    topics = root.find("Plugins/plugin/selected_topics").get("value").split(";")
    for curve in root.iter("curve"):
        name = curve.get("name")
        (topic,) = [topic for topic in topics if name.startswith(f"{topic}/")]
        field = name.removeprefix(f"{topic}/")
        joint, _, of_joint = field.partition("/")
        yield topic, f"{of_joint}[]" if joint and of_joint in JOINT_FIELDS else field.replace("/", ".")


def shown_in_vain(folder: Path, types: dict[str, list[str]]) -> set[tuple[str, str]]:
    """The topics and fields that the layouts of a folder show and that the graph, topics with types, does not have."""
    places = {(topic, field) for topic, fields in shown(folder).items() for field in fields}
    return {(topic, field) for topic, field in places if topic not in types or not has_field(types[topic][0], field)}


def has_field(type_name: str, field: str) -> bool:
    """Whether a message type has a field such as ``wrench.force.x`` or ``velocity[]``."""
    from automax_ros.ros.base.qos import message_class

    kind = type_name
    for part in field.split("."):
        fields = message_class(kind).get_fields_and_field_types()
        name = part.removesuffix("[]")
        if name not in fields:
            return False
        kind = fields[name].removeprefix("sequence<").removesuffix(">").replace("/", "/msg/")
    return True
