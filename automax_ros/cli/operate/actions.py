"""The actions of `automax ctl`, and the arguments that each takes on the command line and at the prompt."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

from automax_ros.cli.operate.press import add_press_arguments
from automax_ros.cli.operate.text import (
    error_lines,
    fields_of,
    message_text,
    reload_text,
    status_lines,
    step_lines,
    task_lines,
    value_lines,
    value_text,
)
from automax_ros.cli.operate.watch import NAMES_HELP, add_watch_arguments, values_of
from automax_ros.cli.options.values import seconds_above_0, whole_number
from automax_ros.core.text import quoted, table
from automax_ros.core.ticks import NS_PER_S, seconds_ns
from automax_ros.core.types import DataType, type_of_name
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.reading.files import FileFault, read_task_source


@dataclass(frozen=True)
class ServiceCall:
    """One request: the service, its type as ``package/Type``, the request's fields, and what it concerns.

    ``reword`` adapts texts of the rack for the user, such as names of files on this computer.
    """

    service: str
    type_name: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    of: str = ""
    reword: Callable[[str], str] = str


class Mode(Enum):
    """How the requests of an action are sent: each once, repeatedly, or as a press of buttons."""

    ONCE = "once"
    WATCH = "watch"
    PRESS = "press"


def _done_text(_: ServiceCall, __: Any) -> str:
    return "done"


@dataclass(frozen=True)
class Action:
    """An action: its line of help, its arguments, its requests, and the presentation of answers.

    ``read`` returns the data of an answer for JSON, ``lines`` the lines of text for these data, ``done_text`` the text
    for an operation that was carried out. ``by_operator``: it needs a rack with the operator's services; ``acts``: it
    changes something, although its answer is read. ``more`` returns the text below its help.
    """

    help: str
    calls: Callable[[argparse.Namespace], list[ServiceCall]]
    add_arguments: Callable[[argparse.ArgumentParser], None] = lambda _: None
    read: Callable[[Any], Any] | None = None
    lines: Callable[[Any], Iterable[str]] = lambda _: ()
    done_text: Callable[[ServiceCall, Any], str] = _done_text
    mode: Mode = Mode.ONCE
    by_operator: bool = True
    acts: bool = False
    more: Callable[[], str] = str

    @property
    def reads(self) -> bool:
        """Whether the action changes nothing in the rack."""
        return self.read is not None and not self.acts


STATE = "state"
_TRANSITIONS = ("configure", "activate", "deactivate", "cleanup", "shutdown")


_MOST_STEPS = 1_000_000
DEFAULT_TIMEOUT_S = "5"


def _press_calls(given: argparse.Namespace) -> list[ServiceCall]:
    """Return the requests that set all names.

    Raises:
        UsageError: a name is not that of a BOOLEAN.
    """
    for name in given.names:
        if type_of_name(name.partition("(")[0].partition("[")[0].strip()) is not DataType.BOOLEAN:
            raise UsageError(f"{quoted(name)} cannot be pressed", "a BOOLEAN can, such as START_PB@; set writes others")
    return [ServiceCall("set", "automax_msgs/SetValue", {"name": name, "value": "TRUE"}, name) for name in given.names]


def _add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("transition", choices=(*_TRANSITIONS, STATE), help="what is asked for; state reads the state")
    parser.add_argument(
        "node", nargs="?", default="rack", metavar="NODE", help="a node, such as processor_1 (default: rack)"
    )


def _lifecycle_calls(given: argparse.Namespace) -> list[ServiceCall]:
    if not given.node.isidentifier() or not given.node.isascii():
        raise UsageError(f"{quoted(given.node)} is not the name of a node", "such as rack, processor_1, udc_10")
    of = f"{given.transition} {given.node}"
    if given.transition == STATE:
        return [ServiceCall(f"{given.node}/get_state", "lifecycle_msgs/GetState", of=of)]
    from lifecycle_msgs.msg import Transition

    wanted = {"transition": Transition(label=given.transition)}
    return [ServiceCall(f"{given.node}/change_state", "lifecycle_msgs/ChangeState", wanted, of, _reason)]


def _reason(_: str) -> str:
    return "the rack's console and /rosout say why"


LIFECYCLE = Action(
    "configure, activate, deactivate, clean up or shut down the node `rack` or a module's; or read its state",
    _lifecycle_calls,
    _add,
    lambda answer: answer.current_state.label if hasattr(answer, "current_state") else "done",
    lambda state: [state],
    by_operator=False,
)


def _tasks(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("tasks", nargs="+", metavar="TASK", help="a task of the rack")


def _some_tasks(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("tasks", nargs="*", metavar="TASK", help="a task of the rack (default: all)")


def _assignments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "assignments", nargs="+", metavar="NAME=VALUE", help="REF%%=1500, TABLE%%(3)=7, RUN@=ON; tune: SPEED.KP=1.2"
    )


def _names(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", nargs="+", metavar="NAME", help=NAMES_HELP)


def _add_release_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", nargs="*", metavar="NAME", help="what is forced")
    parser.add_argument("--all", action="store_true", help="end all forces")


def _add_reload_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("task", metavar="TASK", help="the task")
    parser.add_argument("file", type=Path, metavar="FILE", help="its new source, on this computer")
    parser.add_argument(
        "--keep-state", action="store_true", help="carry values over by name (default: locals 0, tunables as written)"
    )


def _control(
    name: str, help_text: str, value: str = "a position, a number (default: true)"
) -> Callable[[argparse.ArgumentParser], None]:
    def add(parser: argparse.ArgumentParser) -> None:
        parser.add_argument("name", metavar=name, help=help_text)
        parser.add_argument("control", metavar="WHAT", help="as stimuli files write it")
        parser.add_argument("value", nargs="*", metavar="VALUE", help=value)

    return add


def _move_calls(service: str, usual: str = "true") -> Callable[[argparse.Namespace], list[ServiceCall]]:
    def calls(given: argparse.Namespace) -> list[ServiceCall]:
        value = " ".join(given.value) or usual
        fields = {"name": given.name, "control": given.control, "value": value}
        of = f"{given.name} {given.control} {value}".rstrip()
        return [ServiceCall(service, "automax_msgs/OperateControl", fields, of)]

    return calls


def _each_task(service: str) -> Callable[[argparse.Namespace], list[ServiceCall]]:
    return lambda given: [
        ServiceCall(service, "automax_msgs/OperateTask", {"task": name}, name) for name in given.tasks
    ]


def _each_assignment(service: str) -> Callable[[argparse.Namespace], list[ServiceCall]]:
    def calls(given: argparse.Namespace) -> list[ServiceCall]:
        found = []
        for text in given.assignments:
            name, equals, value = text.partition("=")
            if not (name.strip() and equals):
                raise UsageError(f"{quoted(text)} is not NAME=VALUE")
            fields = {"name": name.strip(), "value": value}
            found.append(ServiceCall(service, "automax_msgs/SetValue", fields, f"{name.strip()} = {value}"))
        return found

    return calls


def _release(given: argparse.Namespace) -> list[ServiceCall]:
    names = [] if _means_all(given.names) else given.names
    if bool(given.names) == given.all:
        raise UsageError("unforce takes names, or --all")
    return [ServiceCall("unforce", "automax_msgs/Unforce", {"names": names}, " ".join(names) or "all")]


def _means_all(names: Sequence[str]) -> bool:
    """Return whether ``all`` replaces names, as in stimuli and in `automax step`; a REAL of that name is ``ALL``."""
    return list(names) == ["all"]


def _reload(given: argparse.Namespace) -> list[ServiceCall]:
    try:
        source = read_task_source(given.file)
    except FileFault as fault:
        raise UsageError(f"{given.file} {fault}") from fault
    fields = {"task": given.task, "source": source.text, "keep_state": given.keep_state}
    reword = _naming_file(given.task.strip().upper(), given.file)
    return [ServiceCall("reload", "automax_msgs/Reload", fields, f"{given.task} with {given.file}", reword)]


def _naming_file(task: str, file: Path) -> Callable[[str], str]:
    """Return a function that puts the file's name where the rack names the sent text: ``SPEED.BLK:1:1``."""
    sent = re.compile(rf"^{re.escape(task)}\.[A-Za-z]+(?=[: ])", re.MULTILINE)
    return lambda text: sent.sub(lambda _: str(file), text)


def _clear(given: argparse.Namespace) -> list[ServiceCall]:
    tasks = [""] if _means_all(given.tasks) or not given.tasks else given.tasks
    return [
        ServiceCall("clear_errors", "automax_msgs/OperateTask", {"task": name}, name or "all tasks") for name in tasks
    ]


def _add_step_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "what", nargs="?", choices=("scan", "tick", "until"), default="scan", help="what is stepped (default: scan)"
    )
    parser.add_argument(
        "of", nargs="?", default="", metavar="TASK|SECONDS", help="whose scan or tick; until: the rack time to go to"
    )
    parser.add_argument(
        "--count", type=whole_number, default=1, metavar="N", help="how many scans or ticks (default: 1)"
    )


def _step(given: argparse.Namespace) -> list[ServiceCall]:
    if not 1 <= given.count <= _MOST_STEPS:
        raise UsageError(f"--count: {given.count} is not a number from 1 to {_MOST_STEPS}")
    fields: dict[str, Any] = {"what": given.what, "task": given.of, "count": given.count}
    if given.what == "until":
        try:
            fields = {"what": "until", "until_s": seconds_ns(given.of) / NS_PER_S}
        except ValueError as error:
            raise UsageError(f"step until takes a rack time in seconds, not {quoted(given.of)}") from error
    return [ServiceCall("step", "automax_msgs/Step", fields, " ".join(filter(None, (given.what, given.of))))]


def _add_power_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", choices=("off", "on", "cycle"), help="cycle: off, then on again")
    parser.add_argument(
        "--off-for", type=seconds_above_0, default="1", metavar="S", help="cycle: for how long, s (default: 1)"
    )
    help_text = "on, cycle: non-volatile memory is lost too, as with a bad battery"
    parser.add_argument("--without-battery", action="store_true", help=help_text)


def _power(given: argparse.Namespace) -> list[ServiceCall]:
    fields = {
        "what": given.what,
        "off_for_s": given.off_for / NS_PER_S if given.what == "cycle" else 0.0,
        "without_battery": given.without_battery,
    }
    return [ServiceCall("power", "automax_msgs/Power", fields, given.what)]


def _single_call(service: str, type_name: str) -> Callable[[argparse.Namespace], list[ServiceCall]]:
    return lambda _: [ServiceCall(service, type_name)]


def _plant_verbs() -> str:
    from automax_ros.rack.operator.plant_verbs import PLANT_VERBS

    return _verbs_text((name, verb.wants) for name, verb in PLANT_VERBS.items())


def _web_verbs() -> str:
    from automax_ros.rack.operator.plant_verbs import WEB_VERBS

    return _verbs_text((name, verb.wants) for name, verb in WEB_VERBS.items())


def _verbs_text(verbs: Iterable[tuple[str, str]]) -> str:
    return "\n".join(["what, and its values:", *table([[f"  {name}", wants] for name, wants in verbs])])


ACTIONS: Mapping[str, Action] = {
    "run": Action("put tasks into RUN", _each_task("run"), _tasks),
    "stop": Action("stop tasks", _each_task("stop"), _tasks),
    "delete": Action("take stopped tasks out; a reload brings them back", _each_task("delete"), _tasks),
    "run-all": Action("put all tasks into RUN", _single_call("run_all", "std_srvs/Trigger"), done_text=message_text),
    "stop-all": Action("STOP ALL", _single_call("stop_all", "std_srvs/Trigger"), done_text=message_text),
    "power": Action("switch the power off and on", _power, _add_power_arguments),
    "pause": Action(
        "halt the rack: rack time is frozen", _single_call("pause", "std_srvs/Trigger"), done_text=message_text
    ),
    "step": Action(
        "continue a halted rack by scans, ticks, or until a rack time at most 1 s later",
        _step,
        _add_step_arguments,
        fields_of,
        step_lines,
        acts=True,
    ),
    "resume": Action("continue a halted rack", _single_call("resume", "std_srvs/Trigger"), done_text=message_text),
    "set": Action("write commons once", _each_assignment("set"), _assignments, done_text=value_text),
    "press": Action("hold BOOLEANs at TRUE for a while", _press_calls, add_press_arguments, mode=Mode.PRESS),
    "get": Action(
        "read commons, array elements, variables of tasks",
        lambda given: [ServiceCall("get", "automax_msgs/ReadValues", {"names": given.names})],
        _names,
        values_of,
        value_lines,
    ),
    "watch": Action(
        "read them again and again, and print what has changed",
        lambda given: [ServiceCall("get", "automax_msgs/ReadValues", {"names": given.names}, " ".join(given.names))],
        add_watch_arguments,
        values_of,
        value_lines,
        mode=Mode.WATCH,
    ),
    "force": Action("hold commons or TASK.NAME at values against every write", _each_assignment("force"), _assignments),
    "unforce": Action("end forces", _release, _add_release_arguments),
    "forces": Action(
        "what is forced", _single_call("forces", "automax_msgs/ReadValues"), read=values_of, lines=value_lines
    ),
    "tune": Action("set tunables (TASK.NAME=VALUE)", _each_assignment("tune"), _assignments, done_text=value_text),
    "module": Action("move a switch of a module", _move_calls("module"), _control("SLOT", "the module's slot")),
    "plant": Action(
        "break, mend or load the plant of a drive",
        _move_calls("plant"),
        _control("PLANT", "its name in the rack's file"),
        more=_plant_verbs,
    ),
    "web": Action(
        "break, thread or change the web between two drives",
        _move_calls("web", ""),
        _control("WEB", "its name in the rack's file", "a number, where WHAT takes one"),
        more=_web_verbs,
    ),
    "reload": Action(
        "replace the source of a task while the others run", _reload, _add_reload_arguments, done_text=reload_text
    ),
    "clear": Action("clear error logs, so that faulted tasks can run again", _clear, _some_tasks),
    "errors": Action(
        "the error logs",
        lambda given: [
            ServiceCall("errors", "automax_msgs/ReadErrors", {"task": name}) for name in given.tasks or [""]
        ],
        _some_tasks,
        lambda answer: [fields_of(item) for item in answer.errors],
        error_lines,
    ),
    "tasks": Action(
        "the state of the tasks",
        _single_call("tasks", "automax_msgs/ReadTasks"),
        read=lambda answer: [fields_of(item) for item in answer.tasks],
        lines=task_lines,
    ),
    "status": Action(
        "the state of the rack, and what stopped it",
        _single_call("status", "automax_msgs/ReadStatus"),
        read=fields_of,
        lines=status_lines,
    ),
    "lifecycle": LIFECYCLE,
}
"""The actions by name."""


class ActionParser(argparse.ArgumentParser):
    """The parser of one action; the text below its help is created only when the help is printed."""

    more: Callable[[], str] = str

    def format_help(self) -> str:
        """Return the help with the text below it."""
        below = self.more()
        return super().format_help() + (f"\n{below}\n" if below else "")


def add_actions(
    parser: argparse.ArgumentParser, *, required: bool = True, timeout_s: str = DEFAULT_TIMEOUT_S
) -> argparse._SubParsersAction[ActionParser]:
    """Add all actions with their arguments; ``timeout_s`` is the default of ``--timeout``."""
    actions = parser.add_subparsers(
        title="actions", metavar="ACTION", dest="action", required=required, parser_class=ActionParser
    )
    for name, action in ACTIONS.items():
        own = actions.add_parser(name, help=action.help, description=action.help)
        own.more = action.more
        action.add_arguments(own)
        add_common(own, timeout_s)
    return actions


def add_common(parser: argparse.ArgumentParser, timeout_s: str = DEFAULT_TIMEOUT_S) -> None:
    """Add the arguments that all actions have; ``timeout_s`` is the default of ``--timeout``."""
    parser.add_argument("--json", action="store_true", help="print the answers for programs to read")
    parser.add_argument(
        "--timeout",
        type=seconds_above_0,
        metavar="S",
        default=timeout_s,
        help=f"seconds to look for the rack, and to wait for each answer (default: {timeout_s})",
    )
