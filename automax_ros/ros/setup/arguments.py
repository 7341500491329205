"""The ROS arguments of a command line: ``--ros-args RULE... [--]``, anywhere, any number of times.

Names are read here, since a rack is many nodes in its own namespace; everything else is passed to rcl unchanged. Only
``checked`` needs ROS.

- ``__ns`` is the namespace that contains the rack's own: with ``-r __ns:=/plant`` rack PM1 is ``/plant/pm1`` (decision:
  rcl would put all nodes into ``/plant``, and two racks of one launch file could not be told apart). One that ends in
  the rack's own, ``/plant/pm1``, is the complete one (decision: a LifecycleNode of launch_ros says it so). Without it
  ROS_NAMESPACE is used, which rcl does not read (decision: ROS 1 and several launch systems set it).
- ``__node`` names the program's main node, for a rack ``rack``; ``NODE:__node`` names another (decision: rcl would
  give all nodes of the process that one name).
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.ros.setup.parameter_files import GivenParameter, RosArgumentsError, parameter_of, parameters_of

BEGIN, END = "--ros-args", "--"
MOST_WORDS, LONGEST_WORD = 1000, 4000
"""Limits of the ROS arguments that are read (decision: launch files pass some tens of words)."""
REMAP, PARAM, PARAMS_FILE = "--remap", "--param", "--params-file"
_SHORT = {"-r": REMAP, "-p": PARAM, "-e": "--enclave"}
_WITH_VALUE = (REMAP, PARAM, PARAMS_FILE, "--log-level", "--log-config-file", "--log-file-name", "--enclave")
_SWITCHES = tuple(
    f"--{way}-{what}-logs" for way in ("enable", "disable") for what in ("rosout", "stdout", "external-lib")
)
_NODE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_SPACE = re.compile(r"/?([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*){0,6}/?)?")
_LONGEST_SPACE = 200
_NAMES = ("__node", "__name")
"""Both words name a node, as in rcl."""
_YES_OR_NO = ("use_sim_time", "start_type_description_service")
"""Parameters that every rclpy node declares: one of another type would be an error while a node is being created."""


@dataclass(frozen=True)
class RosArguments:
    """The ROS arguments of a program.

    Attributes:
        namespace: the one that contains the program's own, without slashes at its ends; mostly empty.
        names: new names of nodes by their own; that of the main node under the empty text.
        rules: all others in their order: option and value, or a switch alone.
        parameters: those that the rules give nodes at the start, in their order: the last wins.
        given: whether ``--ros-args`` was given with anything after it.
    """

    namespace: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    rules: tuple[tuple[str, ...], ...] = ()
    parameters: tuple[GivenParameter, ...] = ()
    given: bool = False

    def placed(self, namespace: str) -> str:
        """Return a namespace, without slashes at its ends, inside the given one, unless that ends in it already."""
        if f"/{self.namespace}".endswith(f"/{namespace}"):
            return self.namespace
        return f"{self.namespace}/{namespace}".strip("/")

    def name_of(self, node: str, *, main: bool = False) -> str:
        """Return the name of a node after remapping; ``main``: it is the one that a rule without a node means."""
        return self.names.get(node) or (self.names.get("", node) if main else node)

    def given_to(self, node: str, namespace: str, *, main: bool = False) -> dict[str, GivenParameter]:
        """Return the parameters that are given to a node, by their names.

        Args:
            node: its own name.
            namespace: that of the program's nodes, without slashes at its ends.
            main: whether it is the main one, which launch knows by another name.
        """
        full = [f"/{namespace}/{self.name_of(node, main=main)}"]
        if main and "" in self.names:
            full.append(f"/{self.placed(self.names[''])}")
        return {item.name: item for item in self.parameters if any(item.means(name) for name in full)}

    def without(self, parameter: str) -> RosArguments:
        """Return the same without a parameter."""
        return replace(self, parameters=tuple(item for item in self.parameters if item.name != parameter))

    @property
    def words(self) -> list[str]:
        """The arguments with which a context is initialised.

        The console belongs to the command; nodes log to /rosout and to log files, unless ``--enable-stdout-logs`` is
        given.
        """
        return [BEGIN, "--disable-stdout-logs", *(word for rule in self.rules for word in rule)]

    @property
    def command_line(self) -> list[str]:
        """The same arguments as words for another program."""
        names = (f"{node}:__node:={name}".removeprefix(":") for node, name in self.names.items())
        space = [f"__ns:=/{self.namespace}"] if self.namespace else []
        rules = [*((REMAP, rule) for rule in (*space, *names)), *self.rules]
        return [BEGIN, *(word for rule in rules for word in rule), END] if rules else []

    def checked(self) -> RosArguments:
        """Return itself if rcl accepts the words; ROS must be usable.

        Raises:
            RosArgumentsError: rcl refuses them.
        """
        from rclpy.utilities import remove_ros_args

        try:
            remove_ros_args(["automax", *self.words])
        except RuntimeError as error:
            text = str(error).removeprefix("Failed to parse ROS arguments: ").split(", at /", 1)[0]
            raise RosArgumentsError(f"{BEGIN}: {quoted(text, marks='', limit=300)}") from error
        return self


NO_ARGUMENTS = RosArguments()


def split_arguments(argv: Sequence[str], environ: Mapping[str, str] = os.environ) -> tuple[list[str], RosArguments]:
    """Return a command line without its ROS arguments, and these.

    Raises:
        RosArgumentsError: an unknown option, one without its value, an invalid name.
    """
    words, own, inside = list[str](), list[str](), False
    for word in argv:
        if word == BEGIN:
            inside = True
        elif inside and word == END:
            inside = False
        else:
            (own if inside else words).append(word)
    if len(own) > MOST_WORDS or any(len(word) > LONGEST_WORD for word in own):
        raise RosArgumentsError(f"{BEGIN}: more than {MOST_WORDS} words, or one of more than {LONGEST_WORD} characters")
    return words, _Reader(environ.get("ROS_NAMESPACE", "")).read(own)


class _Reader:
    def __init__(self, namespace: str) -> None:
        self._namespace = _space_of(namespace, "ROS_NAMESPACE")
        self._names: dict[str, str] = {}
        self._rules: list[tuple[str, ...]] = []
        self._parameters: list[GivenParameter] = []

    def read(self, words: list[str]) -> RosArguments:
        rest = iter(words)
        for word in rest:
            option = _SHORT.get(word, word)
            if option in _SWITCHES:
                self._rules.append((option,))
                continue
            if option not in _WITH_VALUE:
                raise _unknown_option(word)
            value = next(rest, None)
            if value is None:
                raise RosArgumentsError(f"{BEGIN}: {word} needs a value")
            if option != REMAP or not self._take_name(value):
                self._rules.append((option, value))
            if option == PARAM:
                self._parameters.append(parameter_of(value))
            elif option == PARAMS_FILE:
                self._parameters += parameters_of(Path(value))
        for item in self._parameters:
            if item.name in _YES_OR_NO and not isinstance(item.value, bool):
                raise RosArgumentsError(f"{item.name} is true or false", place=item.place)
        return RosArguments(
            self._namespace, self._names, tuple(self._rules), tuple(self._parameters), given=bool(words)
        )

    def _take_name(self, rule: str) -> bool:
        """Store a rule that names a namespace or a node; return False if it is for rcl."""
        source, _, target = rule.partition(":=")
        node, _, what = source.rpartition(":")
        if what == "__ns":
            if node:
                hint = "-r __ns:=/plant moves the whole rack"
                raise RosArgumentsError(f"{BEGIN}: {quoted(rule)}: the nodes share one namespace", hint)
            self._namespace = _space_of(target, f"{BEGIN} {quoted(rule)}", absolute=True)
            return True
        if what not in _NAMES:
            return False
        if not _NODE.fullmatch(target) or len(target) > _LONGEST_SPACE:
            raise RosArgumentsError(f"{BEGIN}: {quoted(rule)}: {quoted(target)} is not the name of a node")
        self._names[node] = target
        return True


def _space_of(text: str, of: str, *, absolute: bool = False) -> str:
    wrong = not _SPACE.fullmatch(text) or len(text) > _LONGEST_SPACE or (absolute and not text.startswith("/"))
    if wrong:
        hint = "write it as /plant or /plant/area_1"
        raise RosArgumentsError(f"{of}: {quoted(text)} is not a namespace of ROS", hint)
    return text.strip("/")


def _unknown_option(word: str) -> RosArgumentsError:
    options = (*_WITH_VALUE, *_SWITCHES)
    if ":=" in word:
        return RosArgumentsError(f"{BEGIN}: {quoted(word)} stands without an option", "-r renames, -p sets a parameter")
    hint = near_or_listed(word, options)
    return RosArgumentsError(f"{BEGIN}: unknown option {quoted(word)}", hint)
