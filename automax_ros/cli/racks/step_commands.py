"""The commands of `automax step`: their usage and their functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.cli.racks.step_session import CommandFault, Session
from automax_ros.core.text import count_of, near_or_listed, quoted, table
from automax_ros.rack.operations.operations import Operations


@dataclass(frozen=True)
class Command:
    """A command: its usage, its description, its function, and the least and the most words that it takes."""

    usage: str
    text: str
    act: Callable[[Session, list[str]], None]
    least: int = 0
    most: int = 2


def execute(session: Session, line: str) -> None:
    """Carry out a line: a command and its words; an empty line, or one that begins with #, does nothing.

    Raises:
        UserError: there is no such command, or it cannot be carried out.
        OperationRefused: the rack refuses it now.
    """
    name, *words = line.split() or [""]
    if not name or name.startswith("#"):
        return
    command = COMMANDS.get(name.lower())
    if command is None:
        raise CommandFault(f"there is no command {quoted(name)}", near_or_listed(name.lower(), COMMANDS))
    if not command.least <= len(words) <= command.most:
        raise CommandFault(f"{name} does not take {count_of(len(words), 'word')}", f"write {command.usage}")
    command.act(session, words)


def completions(session: Session, text: str) -> list[str]:
    """Return the words that begin with a text: commands, tasks, names of variables."""
    rack = session.stepper.rack
    names = [variable.name for variable in rack.config.declared]
    owned = [f"{task.name}.{name}" for task in rack.tasks for name in task.compiled.program.symbols]
    known = [*COMMANDS, *(task.name for task in rack.tasks), *names, *owned]
    return [word for word in known if word.lower().startswith(text.lower())]


def _help(session: Session, words: list[str]) -> None:
    names = [word.lower() for word in words if word.lower() in COMMANDS] or list(COMMANDS)
    for line in table([[f"  {COMMANDS[name].usage}", COMMANDS[name].text] for name in names]):
        session.tell(line)


def _operations(session: Session) -> Operations:
    return session.stepper.rack.operations


COMMANDS: dict[str, Command] = {
    "line": Command(
        "line [TASK] [N]",
        "one BASIC line of the scan that is held, or of the next scan",
        lambda s, w: s.step(w, s.stepper.line),
    ),
    "scan": Command(
        "scan [TASK] [N]", "to the end of the next scan, of a task or of any", lambda s, w: s.step(w, s.stepper.scan)
    ),
    "tick": Command(
        "tick [N]",
        "one tick of the first Processor",
        Session.ticks,
        most=1,
    ),
    "go": Command("go [S]", "on to a breakpoint or a fault, S seconds at most", Session.go, most=1),
    "until": Command("until S", "on to rack time S, in seconds, at most", Session.until, 1, 1),
    "break": Command(
        "break [TASK:LINE | NAME]", "halt before a line, or when a variable has changed", Session.add_break, most=1
    ),
    "clear": Command(
        "clear TASK:LINE | NAME | all", "take a breakpoint away", lambda s, w: s.stepper.clear(w[0]), 1, 1
    ),
    "watch": Command("watch [NAME ...]", "show these variables after each step", Session.watch, most=99),
    "unwatch": Command("unwatch [NAME ...]", "show them no longer", Session.unwatch, most=99),
    "show": Command("show NAME ... | TASK", "the values of variables, or of all of a task", Session.show, 1, 99),
    "set": Command("set NAME=VALUE", "write a common", lambda s, w: s.assign(w, s.stepper.rack.adjust.set), 1, 99),
    "force": Command(
        "force NAME=VALUE",
        "hold a common or TASK.NAME at a value",
        lambda s, w: s.assign(w, s.stepper.rack.adjust.force),
        1,
        99,
    ),
    "unforce": Command("unforce [NAME ... | all]", "end forces", Session.unforce, most=99),
    "tune": Command("tune TASK.NAME=VALUE", "set a tunable", Session.tune, 1, 99),
    "run": Command("run TASK", "put a task into RUN", lambda s, w: _operations(s).run(w[0].upper()), 1, 1),
    "stop": Command("stop TASK", "stop a task", lambda s, w: _operations(s).stop(w[0].upper()), 1, 1),
    "run-all": Command("run-all", "put all tasks into RUN", lambda s, _: _operations(s).run_all(), most=0),
    "stop-all": Command(
        "stop-all",
        "stop all tasks and clear volatile memory",
        lambda s, _: _operations(s).stop_all("STOP ALL by command"),
        most=0,
    ),
    "clear-errors": Command(
        "clear-errors [TASK]",
        "clear error logs",
        lambda s, w: _operations(s).clear_errors(w[0].upper() if w else None),
        most=1,
    ),
    "list": Command("list [TASK] [LINE]", "the source of a task", Session.source),
    "tasks": Command("tasks", "the tasks and what they do", lambda s, _: s.tasks(), most=0),
    "errors": Command("errors", "the error logs", lambda s, _: s.errors(), most=0),
    "help": Command("help [COMMAND]", "this list", _help, most=1),
    "quit": Command("quit", "leave", lambda s, _: s.end(), most=0),
}
"""The commands by name."""
