"""What came from outside in a recorded run as a stimuli file, which a person may edit.

A stimuli file writes as the operator: what ROS or another rack wrote is a ``set`` in it. Writes of one instant, and of
one writer, are one entry; the sources of reloads are files next to it. What no verb can say stands as a comment.

A recording is untrusted: none of its texts becomes more of the file than one key or one value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

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
from automax_ros.replay.rerun.events import Event, Operated, Tuned, Written
from automax_ros.replay.rerun.outside import Outside
from automax_ros.scenario.stimuli.rack_verbs import ALL
from automax_ros.scenario.stimuli.reader import MOST_BYTES
from automax_ros.scenario.stimuli.schema import MOST_ENTRIES

_FOR_GOOD_S = 1_000_000
"""Time without power that outlasts any run, s: of a power-off whose return is not recorded."""
_WHOLE_RACK = ("run_all", "stop_all")
_ON_TASK = ("run", "stop", "delete")
_ON_TIME = ("pause", "step", "resume")
_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]{0,39})(?:\.[0-9]{1,40})?(?:[eE][-+]?[0-9]{1,4})?")
_PLAIN = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*[%!@$]?(?:\([0-9]+\))?", re.ASCII)
"""Names and words that stand without quotes, apart from those that YAML takes for something else."""
_NOT_PLAIN = frozenset({"true", "false", "yes", "no", "on", "off", "null"})
_LONGEST_KEY = 1000
"""YAML finds the colon after a longer key only where a question mark is before it."""


class Numeral(str):
    """A number as it stands in a text."""

    __slots__ = ()


Given: TypeAlias = "Value | Numeral | Mapping[str, Given] | Sequence[Given]"
"""What an entry gives to its verb."""


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
        _add(made, 0, "set", dict(outside.settings))
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
            _add(made, event.at_ns, "tune", {f"{act.task}.{act.name}": act.value}, " # by ROS")
        else:
            _add_operated(made, event.at_ns, act, events[number + 1 :], folder)
    if not made.entries:
        made.lines.append("# Nothing came from outside.")
    size = len(made.text.encode())
    if made.entries > MOST_ENTRIES or size > MOST_BYTES:
        what = f"would give {made.entries} entries, {size} bytes; a stimuli file may have {MOST_ENTRIES}"
        raise BagError("AMX6814", bag, f"{what} and {MOST_BYTES}", "write a part, with --from and --to")
    return made


def _add(made: StimuliText, at_ns: int, verb: str, given: Given, remark: str = "") -> None:
    made.lines.append(f"- {_yaml({'at': _seconds(at_ns), verb: given})}{remark}")
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
        values = {element_name(config.variables[view], element): value for view, element, value in named}
        _add(made, at_ns, "set", values, remark)


def _add_operated(made: StimuliText, at_ns: int, act: Operated, later: Sequence[Event], folder: str) -> None:
    what, name, detail = act.what, act.task, act.detail
    if not act.ok:
        _remark(made, at_ns, f"{what} {name} was refused: {act.reason}")
    elif what in _WHOLE_RACK:
        _add(made, at_ns, what, True)
    elif what in _ON_TASK or (what == "clear_errors" and name):
        _add(made, at_ns, what, [name])
    elif what == "clear_errors":
        _add(made, at_ns, what, ALL)
    elif what in ("set", "force", "tune"):
        label, _, text = detail.partition(" = ")
        _add(made, at_ns, what, {label: _said(text) if act.written is None else act.written.entries[0][2]})
        if what == "force":
            made.forced.add(label)
    elif what == "unforce":
        released = set(detail.split())
        every = not released or (len(released) > 1 and released == made.forced)
        made.forced -= released
        _add(made, at_ns, what, ALL if every else detail.split())
    elif what == "reload" and act.source is not None:
        file = _kept_source(made, name, act.source.name, act.source.text)
        keeps: dict[str, Given] = {"keep_state": True} if detail == KEEP_STATE else {}
        _add(made, at_ns, what, {name: {"file": f"{folder}/{file}", **keeps}})
    elif what in ("module", "plant", "web"):
        _add(made, at_ns, what, _work(detail, is_web=what == "web"))
    elif what == "power_off":
        _add_power(made, at_ns, later)
    elif what not in (*_ON_TIME, "power_on"):
        _remark(made, at_ns, f"{what} {name} {detail}: no verb says that")


def _work(detail: str, *, is_web: bool) -> Given:
    """Return what is operated, and what is done to it: ``{7: {test_switch: A}}``, ``{W1: break}``."""
    of, _, rest = detail.partition(" ")
    control, _, value = rest.partition(" ")
    return {of: control if is_web and not value else {control: _said(value)}}


def _add_power(made: StimuliText, at_ns: int, later: Sequence[Event]) -> None:
    returns = ((event.at_ns, event.act) for event in later if isinstance(event.act, Operated) and event.act.ok)
    on = next(((when, act) for when, act in returns if act.what == "power_on"), None)
    off_ns = _FOR_GOOD_S * NS_PER_S if on is None else on[0] - at_ns
    battery: dict[str, Given] = {"battery": False} if on is not None and on[1].detail == WITHOUT_BATTERY else {}
    _add(made, at_ns, "power", {"off_for": _seconds(off_ns), **battery})


def _kept_source(made: StimuliText, task: str, file: str, text: str) -> str:
    """Keep the source of a reload; return its name, that of the same text if it is kept already."""
    stem, _, suffix = source_name(task, file).partition(".")
    number = 1
    while made.sources.get(f"{stem}_{number}.{suffix}", text) != text:
        number += 1
    made.sources[f"{stem}_{number}.{suffix}"] = text
    return f"{stem}_{number}.{suffix}"


def _seconds(time_ns: int) -> Numeral:
    return Numeral(seconds_text(time_ns))


def _said(text: str) -> Given:
    """Return the value that the text of an operation says."""
    if text in ("TRUE", "FALSE"):
        return text == "TRUE"
    is_string = len(text) > 1 and text[0] == text[-1] == '"'
    return Numeral(text) if _NUMBER.fullmatch(text) else text[1:-1] if is_string else text


def _yaml(given: Given) -> str:
    """Return data as YAML in one line."""
    if isinstance(given, bool):
        return "true" if given else "false"
    if isinstance(given, Numeral):
        return given
    if isinstance(given, str):
        return _word(given)
    if isinstance(given, Mapping):
        return f"{{{', '.join(f'{_key(key)}: {_yaml(value)}' for key, value in given.items())}}}"
    return f"[{', '.join(map(_yaml, given))}]" if isinstance(given, Sequence) else value_text(given)


def _key(text: str) -> str:
    if text.isdigit() and _NUMBER.fullmatch(text):
        return text
    return f"{'? ' if len(text) > _LONGEST_KEY else ''}{_word(text)}"


def _word(text: str) -> str:
    """Return a text so that YAML reads it as this text, whatever is in it: in quotes unless it is plain."""
    return text if _PLAIN.fullmatch(text) and text.lower() not in _NOT_PLAIN else f'"{"".join(map(_escaped, text))}"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return f"\\{character}"
    code = ord(character)
    return character if character.isprintable() else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
