"""Whatever texts a recording has, its stimuli are the verbs and values that it means, and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scenario.stimuli.helpers import rack_in

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.yaml_text import read_data
from automax_ros.rack.base.stop_cause import KEEP_STATE
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, ROS_WRITER
from automax_ros.replay.rerun.events import Act, Event, Operated, Tuned, Written
from automax_ros.replay.rerun.outside import Outside
from automax_ros.replay.rerun.stimuli_text import stimuli_text

HOSTILE = [
    "REF%", "TABLE%(1)", "DIAG%(1,0)", "SLOT:5%", "7", "010", "-3.5", "1e5", "9" * 5000, "0x1F", "12:30", "2001-01-01",
    "TRUE", "true", "yes", "Off", "null", "~", "", "all", "<<", "=", "#", "- a", "*a", "&a b", "!!str", "? a", "@", "`",
    "%TAG", "a: b", "a #b", "[", "}", ",", '"', "'", "\\", "|", ">", '"quoted"', "x}}, stop_all: true, set: {A%: {b",
    "x}\n- {at: 0, stop_all: true}", "\r\n- {at: 0, delete: [SPEED]}", "\u2028- x", "\x85", "\x00", "\ufeff", "\ufffe",
    "\U000e0001", "\U0001f600", "é", "a" * 2000, "a b" * 700,
]  # fmt: skip
TEXTS = st.sampled_from(HOSTILE) | st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
WORDS = TEXTS.filter(lambda text: text.split() == [text])
NUMBERS = st.integers(-(2**31), 2**31 - 1) | st.floats(-9.2e18, 9.2e18)
Meant = tuple[str, Any] | None
"""What an act is in the file: its verb and value; None for a remark alone."""


def said(text: str) -> Any:
    """The value in the text of an operation, by hand: as the rack writes it."""
    if text in ("TRUE", "FALSE"):
        return text == "TRUE"
    if len(text) > 1 and text.startswith('"') and text.endswith('"'):
        return text[1:-1]
    return text


def operated(what: str, detail: str = "", task: str = "", **fields: Any) -> Operated:
    return Operated(what, task, detail=detail, **fields)


@st.composite
def acts(draw: st.DrawFn, config: RackConfig) -> tuple[Act, Meant]:
    """An act with any texts, and what it is in the file."""
    text, name, word, other = draw(TEXTS), draw(WORDS), draw(WORDS), draw(WORDS)
    note = next(view for view, item in enumerate(config.variables) if item.name == "NOTE$")
    ref = next(view for view, item in enumerate(config.variables) if item.name == "REF%")
    number = draw(NUMBERS)
    whole = draw(st.integers(-32768, 32767))
    label = name.partition(" = ")[0]
    keeps = draw(st.booleans())
    reload = operated("reload", KEEP_STATE if keeps else "", "SPEED", source=SourceText("bag:SPEED.BLK", text))
    return draw(
        st.sampled_from(
            [
                (operated("run", text, name), ("run", [name])),
                (operated("stop", text, text), ("stop", [text])),
                (operated("clear_errors", text, name), ("clear_errors", [name])),
                (operated("clear_errors"), ("clear_errors", "all")),
                (operated("stop_all", reason=text), ("stop_all", True)),
                (operated("run", text, text, ok=False, reason=text), None),
                (operated("?" + text, text, text, reason=text), None),
                (operated("force", f"{label} = {text}"), ("force", {label: said(text)})),
                (operated("tune", f"{label} = {text}"), ("tune", {label: said(text)})),
                (operated("unforce", f"{name} {word}"), ("unforce", [name, word])),
                (operated("module", f"{name} {word} {text}"), ("module", {name: {word: said(text)}})),
                (operated("plant", f"{name} {word} {text}"), ("plant", {name: {word: said(text)}})),
                (operated("web", f"{name} {word}"), ("web", {name: word})),
                (operated("web", f"{name} {word} {other}"), ("web", {name: {word: said(other)}})),
                (Written(OPERATOR_WRITER, ((note, 0, text), (ref, 0, whole))), ("set", {"NOTE$": text, "REF%": whole})),
                (Written(ROS_WRITER, ((note, 0, text),)), ("set", {"NOTE$": text})),
                (Tuned(name, word, number), ("tune", {f"{name}.{word}": number})),
                (reload, ("reload", {"SPEED": {"file": text} | ({"keep_state": True} if keeps else {})})),
            ]
        )
    )


def same(found: Any, meant: Any) -> bool:
    """Whether what was read is what was meant; a number is equal in value, a key is a text."""
    if isinstance(meant, dict):
        keys = [str(key) for key in found]
        return keys == list(meant) and all(map(same, found.values(), meant.values()))
    if isinstance(meant, list):
        return len(found) == len(meant) and all(map(same, found, meant))
    if isinstance(meant, bool) or isinstance(found, bool):
        return found is meant or (isinstance(meant, bool) and found == str(meant).lower())
    if isinstance(meant, str) and isinstance(found, str):
        return found == meant
    return float(found) == float(meant)


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> RackConfig:
    return rack_in(tmp_path_factory.mktemp("rack")).config


@settings(deadline=None, derandomize=True, max_examples=400)
@given(data=st.data())
def test_the_file_has_the_verbs_and_values_that_are_meant(config: RackConfig, data: st.DataObject) -> None:
    pairs = data.draw(st.lists(acts(config), max_size=6))
    title, folder = data.draw(TEXTS), data.draw(TEXTS)
    events = tuple(Event(1_000_000 * number, act) for number, (act, _) in enumerate(pairs))
    made = stimuli_text(Path("bag"), config, Outside(events), title, folder=folder)
    meant = [(0.001 * number, item) for number, (_, item) in enumerate(pairs) if item is not None]
    for found in (yaml.safe_load(made.text) or [], read_data(made.text) or []):
        assert len(found) == len(meant) == made.entries
        for entry, (at_s, (verb, value)) in zip(found, meant, strict=True):
            assert list(entry) == ["at", verb]
            assert float(entry["at"]) == pytest.approx(at_s)
            if verb == "reload":
                file = entry[verb]["SPEED"]["file"]
                entry[verb]["SPEED"]["file"] = made.sources[file.removeprefix(f"{folder}/")]
            forced = {label for _, (earlier, labels) in meant if earlier == "force" for label in labels}
            all_of_them = verb == "unforce" and entry[verb] == "all" and set(value) <= forced
            assert same(entry[verb], value) or all_of_them, made.text
