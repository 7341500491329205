"""The session of `automax step`: operations on a stepped rack, and the text that shows it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.core.text import count_of, near_or_listed, printable, quoted, table
from automax_ros.core.ticks import seconds_ns, seconds_text
from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import number, source_text, value_of, whole_number
from automax_ros.rack.operations.operations import Operations
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.value_names import setting
from automax_ros.scenario.report import STATUS_WORDS
from automax_ros.scenario.stepper import Halt, Stepper, Variable, Why

MOST_CHANGES = 20
"""How many changed variables are listed after a step (decision); ``watch`` chooses others."""
AROUND = 3
"""Lines shown before and after the marked line."""
_NUMBER = re.compile(r"\s*([0-9]{1,9})\b")


MOST_STEPS = 1_000_000
_DEFAULT_GO_NS = 1 << 62


def place_text(rack: Rack, task: str, line: int) -> str:
    """Return the position of a rack: its time, and the line before which a scan is held."""
    place = f", {task} before line {line}" if task else ""
    return f"{seconds_text(rack.now_ns)} s{place}"


def halt_lines(halt: Halt) -> list[str]:
    """Return why a rack halted, unless it is the normal end of a step."""
    lines = []
    if halt.why is Why.LINE and halt.line:
        lines.append(f"at {halt.task}:{halt.line}")
    if halt.why is Why.STOPPED and halt.cause is not None:
        code = f" (code {halt.cause.code})" if halt.cause.code else ""
        lines.append(f"STOP ALL{code}: {halt.cause.reason}")
    if halt.why is Why.INTERRUPTED:
        lines.append("interrupted")
    if halt.why is Why.CHANGE:
        lines += [f"changed: {item.label}" for item in halt.changes]
    return lines


def change_lines(before: Mapping[str, Value], after: Mapping[str, Value], *, all_of_them: bool) -> list[str]:
    """Return variables before and after a step: those that changed, or all of them."""
    labels = [label for label in after if all_of_them or before.get(label, after[label]) != after[label]]
    rows = [
        [f"  {label}", source_text(before[label]) if label in before else "", "->", source_text(after[label])]
        if before.get(label) != after[label]
        else [f"  {label}", source_text(after[label])]
        for label in labels[:MOST_CHANGES]
    ]
    more = [f"  ... and {len(labels) - MOST_CHANGES} more"] if len(labels) > MOST_CHANGES else []
    return [*table(rows), *more]


def source_lines(text: Sequence[str], line: int, around: int = AROUND) -> list[str]:
    """Return the physical lines of a source around a BASIC line, which is marked; the first ones without it."""
    numbers = [int(found[1]) if (found := _NUMBER.match(item)) else 0 for item in text]
    middle = numbers.index(line) if line in numbers else around
    first, last = max(0, middle - around), middle + around + 1
    return [
        f"{'->' if line and numbers[index] == line else '  '} {printable(text[index])}"
        for index in range(first, min(last, len(text)))
    ]


class CommandFault(UserError):
    """A command cannot be carried out as typed."""


@dataclass
class Session:
    """The session with one stepped rack; ``print_line`` prints a text as a line. ``over`` is TRUE after ``quit``."""

    stepper: Stepper
    print_line: Callable[[str], None]
    over: bool = False
    _watched: dict[str, Variable] = field(default_factory=dict)

    def step(self, words: list[str], one: Callable[[str], Halt]) -> None:
        """Repeat a step of a task the given number of times, or until something else halts the rack."""
        task = next((word for word in words if not word.isdecimal()), "")
        times = self._times([word for word in words if word != task])

        def all_of_them() -> Halt:
            halt = one(task)
            for _ in range(times - 1):
                if halt.why is not Why.DONE:
                    break
                halt = one(task)
            return halt

        self.move(all_of_them)

    def ticks(self, words: list[str]) -> None:
        """Run for a number of ticks of the first Processor."""
        times = self._times(words)
        self.move(lambda: self.stepper.ticks(times))

    def move(self, call: Callable[[], Halt]) -> None:
        """Run the rack by ``call``, and print its variables before and after."""
        before = self.values()
        self.print_halt(call(), before)

    def print_halt(self, halt: Halt, before: dict[str, Value]) -> None:
        """Print where the rack halted, and its variables before and after."""
        for task in self.stepper.rack.tasks:
            while task.printed:
                self.print_line(f"{task.name}: {printable(task.printed.popleft())}")
        self.print_line(place_text(self.stepper.rack, *self.stepper.place))
        for line in halt_lines(halt):
            self.print_line(line)
        for line in change_lines(before, self.values(), all_of_them=bool(self._watched)):
            self.print_line(line)
        if halt.line:
            self.source([halt.task], around=0)

    def values(self) -> dict[str, Value]:
        """Return the values of the watched variables, or of all simple ones if none is watched."""
        shown = self._watched.values() or self._simple_variables()
        return {variable.label: variable.read() for variable in shown}

    def watch(self, words: list[str]) -> None:
        """Show these variables after each step, too, and list all watched ones."""
        for word in words:
            variable = self.stepper.variables.find(word)
            self._watched[variable.label] = variable
        self.show(list(self._watched))

    def unwatch(self, words: list[str]) -> None:
        """Stop showing these variables, or all if none is given."""
        labels = [self.stepper.variables.find(word).label for word in words] or list(self._watched)
        for label in labels:
            self._watched.pop(label, None)

    def show(self, words: list[str]) -> None:
        """Print the values of variables, or of all simple variables of a task."""
        tasks = {task.name for task in self.stepper.rack.tasks}
        found: list[Variable] = []
        for word in words:
            is_task = word.upper() in tasks
            found += self.stepper.variables.of_task(word.upper()) if is_task else [self.stepper.variables.find(word)]
        for line in table([[f"  {item.label}", source_text(item.read())] for item in found]):
            self.print_line(line)

    def assign(self, words: list[str], write: Callable[[str, Value], None]) -> None:
        """Carry out NAME=VALUE; forces and values take effect between scans only."""
        text = " ".join(words)
        own = "." in text.partition("=")[0]
        name, value = self._of_task(text) if own else setting(self.stepper.rack.config, text)
        self.between_scans()
        write(name, value)

    def _of_task(self, text: str) -> tuple[str, Value]:
        """Return name and value of TASK.NAME=VALUE."""
        name, _, given = text.partition("=")
        meant = self.stepper.variables.find(name)
        value = value_of(given.strip(), meant.type, meant.length)
        if value is None:
            raise CommandFault(f"{quoted(given.strip())} is not a value for {meant.label}, type {meant.type.word}")
        return meant.label, value

    def tune(self, words: list[str]) -> None:
        """Carry out TASK.NAME=VALUE for a tunable."""
        name, equals, text = " ".join(words).partition("=")
        if not equals:
            raise CommandFault(f"{quoted(' '.join(words))} is not TASK.NAME=VALUE")
        self.between_scans()
        try:
            self.stepper.rack.adjust.tune(name.strip(), number(text))
        except ValueError as error:
            raise CommandFault(str(error)) from error

    def unforce(self, words: list[str]) -> None:
        """End forces."""
        self.between_scans()
        self.stepper.rack.adjust.unforce(None if words in (["all"], []) else words)

    def between_scans(self) -> None:
        """Refuse a command within a held scan (decision: values from outside come between two scans, as always)."""
        task, line = self.stepper.place
        if task:
            raise CommandFault(f"{task} is held before line {line}: a scan must end first", "write: scan")

    def add_break(self, words: list[str]) -> None:
        """Add a breakpoint, and list all."""
        task, colon, line = "".join(words).partition(":")
        if colon:
            self.stepper.break_at(task, self._whole(line, "a line"))
        elif words:
            self.stepper.break_on("".join(words))
        for place in sorted(self.stepper.lines):
            self.print_line(f"  {place[0]}:{place[1]}")
        for label in self.stepper.watched:
            self.print_line(f"  {label}")

    def source(self, words: list[str], around: int = 5) -> None:
        """Print the source of a task around the line at which it is held."""
        held, line = self.stepper.place
        sources = self.stepper.rack.sources
        name = (words[0].upper() if words else held) or next(iter(sources))
        if name not in sources:
            raise CommandFault(f"the rack has no task {quoted(name)}", near_or_listed(name, sources))
        shown = line if name == held else 0
        if len(words) > 1:
            shown = self._whole(words[1], "a line")
        for text in source_lines(sources[name].lines, shown, around):
            self.print_line(text)

    def tasks(self) -> None:
        """Print the tasks with their status, scans and errors."""
        rack = self.stepper.rack
        rows = [["  task", "module", "status", "scans", "errors"]]
        for module in rack.task_modules:
            for item in module.tasks:
                status, errors = STATUS_WORDS[item.task.status], str(item.task.errors.count)
                rows.append([f"  {item.name}", module.config.name, status, str(item.statistics.scans), errors])
        for line in table(rows, right={3, 4}):
            self.print_line(line)

    def errors(self) -> None:
        """Print the error logs."""
        for task in self.stepper.rack.tasks:
            for entry in task.errors.entries:
                self.print_line(f"  {task.name}: {entry.describe()}")

    def go(self, words: list[str]) -> None:
        """Run the rack, for a time if one is given."""
        for_ns = self._seconds(words[0]) if words else _DEFAULT_GO_NS
        self.move(lambda: self.stepper.go(for_ns))

    def until(self, words: list[str]) -> None:
        """Run the rack to a rack time."""
        time_ns = self._seconds(words[0])
        if time_ns < self.stepper.rack.now_ns:
            raise CommandFault(f"{words[0]} s has passed")
        self.move(lambda: self.stepper.until(time_ns))

    def end(self) -> None:
        """End the session."""
        self.over = True

    def _simple_variables(self) -> Iterator[Variable]:
        """Yield the simple commons, and the locals of the held task, or of all tasks if none is held."""
        rack, (task, _) = self.stepper.rack, self.stepper.place
        for variable in rack.config.declared:
            if not variable.is_array:
                yield self.stepper.variables.find(variable.name)
        for name in [task] if task else [item.name for item in rack.tasks]:
            yield from (item for item in self.stepper.variables.of_task(name) if item.task)

    def _times(self, words: list[str]) -> int:
        times = self._whole(words[0], "the count") if words else 1
        if not 1 <= times <= MOST_STEPS:
            raise CommandFault(f"the count must be between 1 and {MOST_STEPS}, not {times}")
        return times

    @staticmethod
    def _whole(text: str, what: str) -> int:
        try:
            return whole_number(text)
        except ValueError as error:
            raise CommandFault(f"{what} must be a whole number: {error}") from error

    @staticmethod
    def _seconds(text: str) -> int:
        try:
            return seconds_ns(text)
        except ValueError as error:
            raise CommandFault(str(error)) from error


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
        session.print_line(line)


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
