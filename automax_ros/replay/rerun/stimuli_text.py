"""What came from outside in a recorded run as a stimuli file, which a person may edit.

A stimuli file writes as the operator: what ROS or another rack wrote is a ``set`` in it. Writes of one instant, and of
one writer, are one entry; the sources of reloads are files next to it. What no verb can say stands as a comment.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.core.names import element_name
from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.core.types import Value
from automax_ros.core.values import value_text
from automax_ros.messages.types.rack_files import source_name
from automax_ros.rack.base.stop_cause import KEEP_STATE, WITHOUT_BATTERY
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, ROS_WRITER
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.rerun.events import Entry, Event, Operated, Tuned, Written
from automax_ros.replay.rerun.outside import Outside
from automax_ros.scenario.stimuli.reader import MOST_BYTES
from automax_ros.scenario.stimuli.schema import MOST_ENTRIES

_FOR_GOOD_S = 1_000_000
"""Time without power that outlasts any run, s: of a power-off whose return is not recorded."""
_WHOLE_RACK = ("run_all", "stop_all")
_ON_TASK = ("run", "stop", "delete")
_ON_TIME = ("pause", "step", "resume")


@dataclass
class StimuliText:
    """A stimuli file: ``lines``, and the sources of its reloads by file name; ``forced`` is what is so by then."""

    lines: list[str] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)
    entries: int = 0
    forced: set[str] = field(default_factory=set)

    @property
    def text(self) -> str:
        """The whole file."""
        return "\n".join(self.lines) + "\n"


def sources_folder(stimuli: Path) -> str:
    """Return the name of the folder, next to a stimuli file, for the sources of its reloads."""
    return f"{stimuli.stem}_sources"


def stimuli_text(
    bag: Path,
    config: RackConfig,
    outside: Outside,
    title: str,
    *,
    folder: str,
    from_ns: int = 0,
    to_ns: int | None = None,
) -> StimuliText:
    """Return the stimuli of a run, or of a part of it; reloads name files in ``folder``, relative to the stimuli.

    Raises:
        BagError: there are more entries, or more bytes, than a stimuli file may have.
    """
    made = StimuliText([f"# {printable(title)}"])
    events = [event for event in outside.events if from_ns <= event.at_ns and (to_ns is None or event.at_ns <= to_ns)]
    if outside.settings and not from_ns:
        _add(made, 0, "set", {name: _yaml(value) for name, value in outside.settings})
    if outside.begins_ns:
        when = seconds_text(outside.begins_ns)
        state = "with what had happened by then; `automax run` begins without that."
        made.lines.append(f"# The recording begins at {when} s of its run, {state}")
    elif outside.states or outside.forced or outside.stock:
        made.lines.append("# The run began with values kept from an earlier one: give `automax run` the same --state.")
    for number, event in enumerate(events):
        act = event.act
        if isinstance(act, Written):
            _add_written(made, config, event.at_ns, act)
        elif isinstance(act, Tuned):
            tunable = {f"{act.task}.{act.name}": _yaml(_tuned_value(act))}
            _add(made, event.at_ns, "tune", tunable, " # by ROS")
        else:
            _add_operated(made, event.at_ns, act, events[number + 1 :], folder)
    if not made.entries:
        made.lines.append("# Nothing came from outside.")
    if made.entries > MOST_ENTRIES or len(made.text) > MOST_BYTES:
        what = f"would give {made.entries} entries, {len(made.text)} bytes; a stimuli file may have {MOST_ENTRIES}"
        raise BagError("AMX6814", bag, f"{what} and {MOST_BYTES}", "write a part, with --from and --to")
    return made


def _add(made: StimuliText, at_ns: int, verb: str, values: Mapping[str, str], remark: str = "") -> None:
    inner = ", ".join(f"{_key(name)}: {value}" for name, value in values.items())
    _entry(made, at_ns, verb, f"{{{inner}}}", remark)


def _entry(made: StimuliText, at_ns: int, verb: str, value: str, remark: str = "") -> None:
    made.lines.append(f"- {{at: {seconds_text(at_ns)}, {verb}: {value}}}{remark}")
    made.entries += 1


def _remark(made: StimuliText, at_ns: int, text: str) -> None:
    made.lines.append(f"# at {seconds_text(at_ns)}: {printable(text)}")


def _add_written(made: StimuliText, config: RackConfig, at_ns: int, act: Written) -> None:
    named = [item for item in act.entries if config.variables[item[0]].bank is None]
    remark = {OPERATOR_WRITER: "", ROS_WRITER: " # from ROS"}.get(act.writer, " # from the network")
    if act.writer not in (OPERATOR_WRITER, ROS_WRITER):
        named += [item for item in act.shown if config.variables[item[0]].bank is None]
    elif len(named) < len(act.entries):
        _remark(made, at_ns, "registers were written that have no name")
    if named:
        _add(made, at_ns, "set", dict(_named(config, named)), remark)


def _named(config: RackConfig, entries: Sequence[Entry]) -> Iterator[tuple[str, str]]:
    for view, element, value in entries:
        yield element_name(config.variables[view], element), _yaml(value)


def _add_operated(made: StimuliText, at_ns: int, act: Operated, later: Sequence[Event], folder: str) -> None:
    what, name, detail = act.what, act.task, act.detail
    if not act.ok:
        _remark(made, at_ns, f"{what} {name} was refused: {act.reason}")
    elif what in _WHOLE_RACK:
        _entry(made, at_ns, what, "true")
    elif what in _ON_TASK or (what == "clear_errors" and name):
        _entry(made, at_ns, what, f"[{name}]")
    elif what == "clear_errors":
        _entry(made, at_ns, what, "all")
    elif what in ("set", "force", "tune"):
        label, _, text = detail.partition(" = ")
        value = _yaml(act.written.entries[0][2]) if act.written is not None else _text_value(text)
        _add(made, at_ns, what, {label: value})
        if what == "force":
            made.forced.add(label)
    elif what == "unforce":
        released = set(detail.split())
        every = not released or (len(released) > 1 and released == made.forced)
        made.forced -= released
        _entry(made, at_ns, what, "all" if every else f"[{', '.join(map(_key, detail.split()))}]")
    elif what == "reload" and act.source is not None:
        file = _kept_source(made, name, act.source.name, act.source.text)
        keeps = ", keep_state: true" if detail == KEEP_STATE else ""
        _add(made, at_ns, what, {name: f"{{file: {_quoted(f'{folder}/{file}')}{keeps}}}"})
    elif what in ("module", "plant", "web"):
        _add(made, at_ns, what, dict([_work(detail, is_web=what == "web")]))
    elif what == "power_off":
        _add_power(made, at_ns, later)
    elif what not in (*_ON_TIME, "power_on"):
        _remark(made, at_ns, f"{what} {name} {detail}: no verb says that")


def _work(detail: str, *, is_web: bool) -> tuple[str, str]:
    """Return what is operated, and what is done to it: ``7`` and ``{test_switch: A}``, ``W1`` and ``break``."""
    of, _, rest = detail.partition(" ")
    control, _, value = rest.partition(" ")
    if is_web and not value:
        return of, control
    return of, f"{{{control}: {_quoted(value) if ' ' in value else value or '~'}}}"


def _add_power(made: StimuliText, at_ns: int, later: Sequence[Event]) -> None:
    returns = ((event.at_ns, event.act) for event in later if isinstance(event.act, Operated) and event.act.ok)
    on = next(((when, act) for when, act in returns if act.what == "power_on"), None)
    off_ns = _FOR_GOOD_S * NS_PER_S if on is None else on[0] - at_ns
    battery = ", battery: false" if on is not None and on[1].detail == WITHOUT_BATTERY else ""
    _entry(made, at_ns, "power", f"{{off_for: {seconds_text(off_ns)}{battery}}}")


def _kept_source(made: StimuliText, task: str, file: str, text: str) -> str:
    """Keep the source of a reload; return its name, that of the same text if it is kept already."""
    stem, _, suffix = source_name(task, file).partition(".")
    number = 1
    while made.sources.get(f"{stem}_{number}.{suffix}", text) != text:
        number += 1
    made.sources[f"{stem}_{number}.{suffix}"] = text
    return f"{stem}_{number}.{suffix}"


def _tuned_value(act: Tuned) -> Value:
    return int(act.value) if act.name.endswith(("%", "!")) and not isinstance(act.value, str) else act.value


def _yaml(value: Value) -> str:
    """Return a value as a stimuli file writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return _quoted(value) if isinstance(value, str) else value_text(value)


def _text_value(text: str) -> str:
    return {"TRUE": "true", "FALSE": "false"}.get(text, text)


def _key(name: str) -> str:
    return f'"{name}"' if "," in name or ":" in name else name


def _quoted(text: str) -> str:
    escaped = "".join(
        f"\\{character}" if character in '"\\' else character if character.isprintable() else f"\\u{ord(character):04x}"
        for character in text
    )
    return f'"{escaped}"'
