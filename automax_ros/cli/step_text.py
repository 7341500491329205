"""What `automax step` prints: where the rack halts, what has changed, the lines of a task around one."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from automax_ros.core.text import printable, table
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.rack.rack import Rack
from automax_ros.rack.stepping.stepper import Halt, Why

MOST_CHANGES = 20
"""How many changed variables are listed after a step (decision); ``watch`` chooses others."""
AROUND = 3
"""Lines shown before and after one."""
_NUMBER = re.compile(r"\s*([0-9]{1,9})\b")


def place_text(rack: Rack, task: str, line: int) -> str:
    """Return where a rack is: its time, and the line before which a scan is held."""
    place = f", {task} before line {line}" if task else ""
    return f"{seconds_text(rack.now_ns)} s{place}"


def halt_lines(halt: Halt) -> list[str]:
    """Return why a rack halts, where that is news."""
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
