"""Measures as text: ``rms(SPEED_ERR%) settle(SPEED%, 2 %) max(CUR%, from=1.0 to=3.0)``.

A list of calls, with blanks or commas between them; only numbers are evaluated. Signals of webs, rolls and rollers
can be measured too: ``max(W1/tension_n)``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.ticks import exact_ns, seconds_text
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UserError
from automax_ros.core.values import number
from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.rack_names import RackNames, SignalName
from automax_ros.sweep import functions
from automax_ros.sweep.functions import Accumulator

MOST_MEASURES = 50
"""Most measures of one sweep (decision)."""
MOST_CHARACTERS = 4000
"""Longest text of measures (decision: it is read as a whole)."""
MEASURED = {**END_KINDS, **WEB_KINDS}
"""The signals that can be measured, with their types: those of webs, rolls and rollers."""
_CALL = re.compile(r"[\s,]*([A-Za-z_]{1,40})[ \t]*(\()?")
_TIMES = re.compile(r"[\s,]*\b(from|to)\s*=\s*([^\s,()]*)")


class Subject(Enum):
    """Kinds of subjects of a function: the value is in words."""

    NUMBER = "an INTEGER, DOUBLE INTEGER or REAL"
    BOOLEAN = "a BOOLEAN"
    TASK = "a task"
    NOTHING = "nothing"


@dataclass(frozen=True)
class Function:
    """A function of measures: its subject, how many numbers may follow, the maker of its accumulator, its ``unit``.

    With ``percent`` the first number may be a percentage.
    """

    subject: Subject
    text: str
    unit: str = ""
    least: int = 0
    most: int = 0
    percent: bool = False
    make: Callable[..., Accumulator] = functions.Final


_NUMBER, _BOOLEAN = Subject.NUMBER, Subject.BOOLEAN
FUNCTIONS: Mapping[str, Function] = {
    "rms": Function(_NUMBER, "root of the mean square", make=functions.Rms),
    "mean": Function(_NUMBER, "average over time", make=functions.Mean),
    "min": Function(_NUMBER, "least value", make=functions.Least),
    "max": Function(_NUMBER, "greatest value", make=functions.Most),
    "abs_max": Function(_NUMBER, "greatest distance from 0", make=functions.MostAbsolute),
    "final": Function(_NUMBER, "value at the end"),
    "settle": Function(
        _NUMBER, "when it is in the band for good: settle(X, BAND [%] [, TARGET])", "s", 1, 2, True, functions.Settle
    ),
    "overshoot": Function(_NUMBER, "beyond the target: overshoot(X [, TARGET])", "%", 0, 1, make=functions.Overshoot),
    "rise": Function(_NUMBER, "from 10 % to 90 % of the step: rise(X [, TARGET])", "s", 0, 1, make=functions.Rise),
    "itae": Function(_NUMBER, "integral of time times error: itae(X [, TARGET])", "", 0, 1, make=functions.Itae),
    "count": Function(_BOOLEAN, "how often it becomes TRUE", make=functions.Count),
    "time": Function(_BOOLEAN, "how long it is TRUE", "s", make=functions.TimeTrue),
    "errors": Function(Subject.TASK, "errors in the task's log at the end"),
    "stopped": Function(Subject.NOTHING, "1 where the rack is stopped at the end, else 0"),
}
"""All functions by name."""


@dataclass(frozen=True)
class Measure:
    """A measure; ``subject`` is a common with its subscripts, a signal such as ``W1/tension_n``, a task, or "".

    ``numbers`` follow the subject, the first of them in % with ``percent``. The window is from ``start_ns`` to
    ``end_ns``, the run's end if that is None.
    """

    function: str
    subject: str = ""
    numbers: tuple[float, ...] = ()
    percent: bool = False
    start_ns: int = 0
    end_ns: int | None = None

    @property
    def label(self) -> str:
        """The measure's text."""
        if not self.subject:
            return self.function
        parts = [self.subject, *map(_number_text, self.numbers)]
        if self.percent:
            parts[1] += " %"
        parts += [f"from={seconds_text(self.start_ns)}"] if self.start_ns else []
        parts += [f"to={seconds_text(self.end_ns)}"] if self.end_ns is not None else []
        return f"{self.function}({', '.join(parts)})"

    @property
    def is_watched(self) -> bool:
        """Whether it watches a common or a signal, over the run."""
        return FUNCTIONS[self.function].subject in (Subject.NUMBER, Subject.BOOLEAN)

    def accumulator(self) -> Accumulator:
        """Return a new accumulator for one run."""
        function = FUNCTIONS[self.function]
        return function.make(*self.numbers, percent=self.percent) if function.percent else function.make(*self.numbers)


def read_measures(text: str, config: RackConfig, duration_ns: int) -> tuple[Measure, ...]:
    """Return the measures of a list for runs of a rack, each once, in their order.

    Raises:
        UserError: it cannot be read, or names something that the rack does not have.
    """
    if len(text) > MOST_CHARACTERS:
        raise UserError(f"{len(text)} characters of measures: at most {MOST_CHARACTERS} are read")
    found: list[Measure] = []
    place = 0
    while text[place:].strip(" \t\r\n,"):
        match = _CALL.match(text, place)
        if match is None:
            raise UserError(f"{quoted(text[place:].strip())} is not a measure", "such as rms(SPEED_ERR%)")
        place = match.end()
        inner = ""
        if match[2]:
            end = _closing(text, place)
            inner, place = text[place:end], end + 1
        found.append(_measure(match[1].lower(), inner, config, duration_ns))
    measures = tuple(dict.fromkeys(found))
    if not measures:
        raise UserError(
            "nothing is measured", f"name measures, such as rms(SPEED_ERR%); there are {', '.join(FUNCTIONS)}"
        )
    if len(measures) > MOST_MEASURES:
        raise UserError(f"{len(measures)} measures: a sweep has at most {MOST_MEASURES}")
    return measures


def _closing(text: str, place: int) -> int:
    depth = 1
    for at in range(place, len(text)):
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        if not depth:
            return at
    raise UserError(f"{quoted(text[place:])}: a ) is missing")


def _measure(name: str, inner: str, config: RackConfig, duration_ns: int) -> Measure:
    function = FUNCTIONS.get(name)
    if function is None:
        raise UserError(f"there is no measure {quoted(name)}", near_or_listed(name, FUNCTIONS))
    times = _times(name, inner)
    subject, *others = _parts(_TIMES.sub("", inner))
    if not function.least <= len(others) <= function.most:
        raise UserError(f"{name} cannot have {len(others)} numbers", f"{name}: {function.text}")
    percent = bool(function.percent and others and others[0].endswith("%"))
    if percent:
        others[0] = others[0].removesuffix("%")
    try:
        numbers = tuple(map(number, others))
    except ValueError as error:
        raise UserError(f"{name}: {error}", f"{name}: {function.text}") from None
    start_ns, end_ns = times.get("from", 0), times.get("to")
    if times and function.subject in (Subject.TASK, Subject.NOTHING):
        raise UserError(f"{name} is of the run's end, and takes no from= and to=")
    if not start_ns < (duration_ns if end_ns is None else end_ns) <= duration_ns:
        raise UserError(f"{name}: the window is empty, or not within the {seconds_text(duration_ns)} s of a run")
    if numbers and function.percent and numbers[0] < 0:
        raise UserError(f"{name}: a band is not negative")
    return Measure(name, _subject(function, name, subject, config), numbers, percent, start_ns, end_ns)


def _parts(inner: str) -> list[str]:
    parts, depth = [""], 0
    for char in inner:
        depth += {"(": 1, ")": -1}.get(char, 0)
        if char == "," and not depth:
            parts.append("")
        else:
            parts[-1] += char
    return [part.strip() for part in parts]


def _times(name: str, inner: str) -> dict[str, int]:
    found: dict[str, int] = {}
    for key, text in _TIMES.findall(inner):
        if key in found:
            raise UserError(f"{name} has {key}= twice")
        try:
            found[key] = exact_ns(text)
        except ValueError as error:
            raise UserError(f"{name}: {key}={quoted(text, marks='')}: {error}") from None
    return found


def _subject(function: Function, name: str, text: str, config: RackConfig) -> str:
    if function.subject is Subject.NOTHING:
        if text:
            raise UserError(f"{name} is of the rack, not of {quoted(text)}", f"write {name}")
        return ""
    if not text:
        raise UserError(f"{name} is of {function.subject.value}, and names none", f"such as {name}(X)")
    if function.subject is Subject.TASK:
        tasks = [task.name for _, task in config.placed_tasks]
        if text.upper() not in tasks:
            raise UserError(f"the rack has no task {quoted(text)}", near_or_listed(text.upper(), tasks))
        return text.upper()
    if "/" in text:
        return _signal(function, name, text, config)
    meant = config.common(text)
    kind = meant.variable.type
    if not (kind is DataType.BOOLEAN if function.subject is Subject.BOOLEAN else kind.is_numeric):
        raise UserError(f"{name} is of {function.subject.value}; {meant.label} is a {kind.word}")
    return meant.label


def _signal(function: Function, name: str, text: str, config: RackConfig) -> str:
    meant = RackNames(config, ()).find(text)
    assert isinstance(meant, SignalName)
    if meant.signal not in MEASURED:
        hint = f"feed it into a common and measure that; signals that can be measured are {', '.join(MEASURED)}"
        raise UserError(f"{meant.label} cannot be measured itself", hint)
    kind = MEASURED[meant.signal]
    if not (kind is DataType.BOOLEAN if function.subject is Subject.BOOLEAN else kind.is_numeric):
        raise UserError(f"{name} is of {function.subject.value}; {meant.label} is a {kind.word}")
    return meant.label


def _number_text(value: float) -> str:
    """Return the shortest text that is read as the same number."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)
