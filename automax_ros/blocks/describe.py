"""The documentation of the control blocks as text, from their declarations alone."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence

from automax_ros.blocks.declare.declaration import Block, Form, Input, Output, Platform, Special, Time
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.types import DataType, Value

WIDTH = 100
"""Longest line of the texts, in characters."""
UNKNOWN_TIME = "Execution time: the manual prints none; `automax load` counts with an estimate."
"""Printed instead of the times of a block that is not in the manual's tables 4 to 6."""
_PLACE_HOLDERS = {DataType.REAL: "nnn.n", DataType.BOOLEAN: "TRUE", DataType.STRING: '"text"'}


def summary(blocks: Iterable[Block]) -> str:
    """Return one line per block: name, section of the manual, what it does."""
    rows = [(block.name, block.section, block.title, block.function) for block in blocks]
    return "".join(f"{row}\n" for row in _table(rows))


def description(block: Block) -> str:
    """Return the full documentation of a block, ending with a template to paste."""
    parts = [
        f"{block.name}: {block.title} (J-3676-5, section {block.section})\n",
        textwrap.fill(block.function, WIDTH, initial_indent="    ", subsequent_indent="    ") + "\n",
        _section("Inputs", input_rows(block)),
    ]
    if block.outputs:
        parts.append(_section("Outputs", output_rows(block)))
    if block.coefficients:
        parts.append(_section("Limits", limit_rows(block)))
    parts.append(_list("Rules", [rule.text for rule in block.rules]))
    parts.append(_list("Notes", list(block.notes)))
    parts.append(_list("Logs", [f"{code} {PROBLEMS[code].title}" for code in block.problems]))
    parts.append("Runs on: " + ", ".join(item.value for item in Platform if item in block.runs_on) + "\n")
    times = time_rows(block)
    parts.append(_section("Execution time, microseconds (section 53)", times) if times else f"{UNKNOWN_TIME}\n")
    parts.append("Template\n\n" + template(block))
    return "\n".join(part for part in parts if part)


def template(block: Block) -> str:
    """Return a CALL with every keyword, as in TEMPLATE.BLK: ``nnnnn`` and the names are to be replaced.

    A literal-only parameter has its sample or default, or ``nnnnn`` and ``nnn.n`` where it has neither.
    """
    head = f"nnnnn CALL {block.name}("
    arguments = [f"{item.name}={_place_holder(item)}" for item in block.parameters]
    lines = [head + arguments[0], *(" " * len(head) + argument for argument in arguments[1:])]
    width = max(len(line) for line in lines) + 2
    continued = [f"{line},".ljust(width) + "&" for line in lines[:-1]]
    return "".join(f"{line}\n" for line in (*continued, lines[-1] + ")"))


def templates(blocks: Iterable[Block]) -> str:
    """Return the templates of all blocks, a blank line between them."""
    return "\n".join(template(block) for block in blocks)


def _place_holder(item: Input | Output) -> str:
    if isinstance(item.type, Special):
        return "event_name" if item.type.element is None else item.variable + item.type.element.value
    if isinstance(item, Input) and item.form is Form.LITERAL:
        value = item.default if item.sample is None else item.sample
        return _PLACE_HOLDERS.get(item.type, "nnnnn") if value is None else _literal(value)
    return item.variable + item.type.value


def _literal(value: Value) -> str:
    return str(value).upper() if isinstance(value, bool) else str(value)


def _type_word(item: Input | Output) -> str:
    if isinstance(item.type, Special):
        return item.type.value if item.type.element is None else item.type.element.word
    also = item.also if isinstance(item, Input) else None
    if isinstance(item, Output) and item.dimensions:
        return f"{item.type.word} ({','.join(str(size - 1) for size in item.dimensions)})"
    return item.type.word if also is None else f"{also.word}/DOUBLE"


def input_rows(block: Block) -> list[tuple[str, ...]]:
    """Return one row per input: name, symbol, type, need, form, meaning."""
    return [
        (item.name, _symbol(block, item), _type_word(item), _need(item), _form(item), _remarks(block, item))
        for item in block.inputs
    ]


def _need(item: Input) -> str:
    if item.required:
        return "required"
    return "optional" if item.default is None else f"default {_literal(item.default)}"


def _form(item: Input) -> str:
    if isinstance(item.type, Special):
        words = {Special.EVENT: "name only", Special.TABLE: "array only"}
        return words.get(item.type, "structure name")
    return item.form.value


def _symbol(block: Block, item: Input | Output) -> str:
    """Return the manual's abbreviation, nothing in a block for which it prints none."""
    return item.symbol if any(other.symbol != other.name for other in block.parameters) else ""


def _remarks(block: Block, item: Input) -> str:
    text = item.text
    if item.one_of:
        text += f" ({', '.join(str(value) for value in item.one_of)})"
    if item.low is not None or item.high is not None:
        text += f" ({item.low} to {item.high})"
    if not block.runs_on <= item.runs_on:
        text += f" ({', '.join(sorted(processor.value for processor in item.runs_on))} only)"
    return text


def output_rows(block: Block) -> list[tuple[str, ...]]:
    """Return one row per output: name, symbol, type, need, meaning."""
    return [
        (item.name, _symbol(block, item), _type_word(item), "required" if item.required else "optional", item.text)
        for item in block.outputs
    ]


def limit_rows(block: Block) -> list[tuple[str, ...]]:
    """Return one row per limit of coefficients, and one that explains the formulas where there are any."""
    assert block.coefficients is not None
    rows: list[tuple[str, ...]]
    rows = [(limit.parameter, limit.low_text, "to", limit.high_text) for limit in block.coefficients.limits]
    formulas = {part for row in rows for text in row[1:] for part in text.split()}
    if not formulas & {"T", "T)", "C"}:
        return rows
    mapping = ", C = WM / tan(WM T / 2)" if "C" in formulas else ""
    return [*rows, ("", f"with T the scan period in s{mapping}")]


def time_rows(block: Block) -> list[tuple[str, ...]]:
    """Return a row for each Processor that runs the block: its name, the execution time."""
    times = block.times
    named: Mapping[str, Time | None] = {
        "7010 (57C435)": times.model_7010,
        "6010, 6011 (57C430A, 57C431)": times.model_6010,
        "UDC": times.udc,
        "PC3000": times.pc3000,
    }
    return [(name, _time(time)) for name, time in named.items() if time is not None]


def _time(time: Time) -> str:
    """Return an execution time with its terms as the manual prints them, such as ``10.80 + j(1.88)``."""
    terms = [f"{letter}({factor:g})" for letter in "nkjpmotibd" if (factor := getattr(time, letter))]
    if time.alone:
        terms.append(f"{time.alone:g} where the task is the only one")
    return " + ".join([f"{time.base:.2f}", *terms])


def _section(title: str, rows: Sequence[tuple[str, ...]]) -> str:
    return f"{title}\n" + "".join(f"  {line}\n" for line in _table(rows, WIDTH - 2))


def _list(title: str, sentences: list[str]) -> str:
    if not sentences:
        return ""
    lines = [textwrap.fill(text, WIDTH, initial_indent="  - ", subsequent_indent="    ") for text in sentences]
    return f"{title}\n" + "".join(f"{line}\n" for line in lines)


def _table(rows: Sequence[tuple[str, ...]], width: int | None = None) -> list[str]:
    """Return rows as lines with aligned columns; with a width the last column of a long row wraps under itself."""
    columns = max(map(len, rows))
    full = [row for row in rows if len(row) == columns]
    widths = [max(len(row[column]) for row in full) for column in range(columns - 1)]
    lines: list[str] = []
    for row in rows:
        head = "".join(cell.ljust(widths[column]) + "  " for column, cell in enumerate(row[:-1]))
        room = max(24, width - len(head)) if width else len(row[-1]) or 1
        wrapped = textwrap.wrap(row[-1], room) or [""]
        lines.append((head + wrapped[0]).rstrip())
        lines.extend(" " * len(head) + rest for rest in wrapped[1:])
    return lines
