"""The JSON schemas of rack files and stimuli files: they take what the readers take, and know no other keys."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from rack.helpers import rack_at
from yaml_core import data_of

import automax_ros.core
from automax_ros.rackfile.loader import KEYS, load, schema
from automax_ros.rackfile.modules.registry import KINDS, SUPPORTED, module_number
from automax_ros.scenario.stimuli.rack_verbs import rack_verbs
from automax_ros.scenario.stimuli.schema import VERB_SCHEMAS
from automax_ros.scenario.stimuli.schema import schema as stimuli_schema

ROOT = Path(__file__).parents[3]
FAULTY = Path(__file__).parents[2] / "rackfile" / "faulty"
PAGES = Path(automax_ros.core.__file__).parent / "pages"
FORM = {"AMX6007", "AMX6008", "AMX6009"}
"""Problems of a file's form: a wrong kind of value, a key that is not known or missing. Data has each key once."""
RACKS = sorted(
    path
    for folder in ("config", "test")
    for path in (ROOT / folder).rglob("*.yaml")
    if FAULTY not in path.parents and re.search(r"^rack:", path.read_text(encoding="utf-8"), re.M)
)
STIMULI = sorted([*ROOT.glob("config/*/*.yaml"), *ROOT.glob("test/system/**/*.yaml")])
STIMULI = [path for path in STIMULI if re.search(r"^- +\{? *at:", path.read_text(encoding="utf-8"), re.M)]


def judge(what: Any) -> jsonschema.Draft202012Validator:
    plain = json.loads(json.dumps(what))
    jsonschema.Draft202012Validator.check_schema(plain)
    return jsonschema.Draft202012Validator(plain)


RACK, STIMULUS = judge(schema()), judge(stimuli_schema())


def refused(validator: jsonschema.Draft202012Validator, data: Any) -> list[str]:
    return [f"{error.json_path}: {error.message}" for error in validator.iter_errors(data)]


def fenced(text: str) -> Iterator[str]:
    """The YAML in a page that is a whole rack file."""
    for block in re.findall(r"^```yaml\n(.*?)^```$", text, re.M | re.S):
        if re.search(r"^rack:.*\n(?:.*\n)*slots:", block, re.M):
            yield block


def cures() -> list[Any]:
    pages = ((path.stem, path.read_text(encoding="utf-8")) for path in sorted(PAGES.glob("AMX6*.md")))
    return [
        pytest.param(block, id=code)
        for code, text in pages
        if "\n## Cure\n" in text
        for block in fenced(text.split("\n## Cure\n")[1])
    ]


@pytest.mark.parametrize("path", RACKS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_racks_of_examples_and_tests_are_valid(path):
    assert refused(RACK, data_of(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("path", STIMULI, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_stimuli_of_examples_and_tests_are_valid(path):
    assert refused(STIMULUS, data_of(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("text", cures())
def test_racks_that_cure_a_problem_are_valid(text):
    assert refused(RACK, data_of(text)) == []


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("*.md")), ids=lambda path: path.name)
def test_racks_of_the_docs_are_valid(path):
    for block in fenced(path.read_text(encoding="utf-8")):
        assert refused(RACK, data_of(block)) == []


def test_there_is_enough_to_judge():
    assert len(RACKS) >= 6
    assert len(STIMULI) >= 3
    assert len(cures()) > 60


FAULTS = [
    pytest.param(path.read_text(encoding="utf-8"), validator, id=f"{kind}/{path.stem}")
    for kind, validator in (("racks", RACK), ("stimuli", STIMULUS))
    for path in sorted((FAULTY / kind).glob("*.yaml"))
    if FORM & set(re.findall(r"^#! \d+ (AMX\d{4})", path.read_text(encoding="utf-8"), re.M))
]


@pytest.mark.parametrize(("text", "validator"), FAULTS)
def test_faults_of_form_are_refused(text, validator):
    assert refused(validator, data_of(text))


def sections(data: Any, place: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """The places of all mappings in a rack file that have fixed keys: not those whose keys are names."""
    if isinstance(data, dict):
        if not place or place[-1] not in ("slots", "tasks", "plants", "common", "feeds"):
            yield place
        for key, value in data.items():
            yield from sections(value, (*place, key))


def with_key(data: Any, place: tuple[str | int, ...]) -> Any:
    changed = json.loads(json.dumps(data))
    inner = changed
    for step in place:
        inner = inner[step]
    inner["no_key"] = 1
    return changed


WHOLE = [*RACKS, *(path for path in [ROOT / "docs" / "plants.md", ROOT / "docs" / "rack_yaml.md"])]


@pytest.mark.parametrize("path", WHOLE, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_key_that_is_not_known_is_refused_wherever_it_stands(path, tmp_path):
    text = path.read_text(encoding="utf-8")
    for rack in [text] if path.suffix == ".yaml" else fenced(text):
        data = data_of(rack)
        places = list(sections(data))
        assert places
        for place in places:
            assert refused(RACK, with_key(data, place)), place


@pytest.mark.parametrize("place", list(sections(data_of((ROOT / "config/dc_drive/rack.yaml").read_text()))), ids=str)
def test_the_loader_refuses_the_same_keys(place, tmp_path):
    """JSON is YAML: the changed file is written as such."""
    path = tmp_path / "rack.yaml"
    path.write_text(json.dumps(with_key(data_of((ROOT / "config/dc_drive/rack.yaml").read_text()), place), indent=1))
    assert "AMX6007" in [item.code for item in load(path).diagnostics]


def keys_of(part: Any) -> set[str]:
    """All fixed keys that a schema knows."""
    if isinstance(part, dict):
        own = set(part.get("properties", {}))
        return own.union(*(keys_of(value) for value in part.values()))
    return set().union(*(keys_of(item) for item in part)) if isinstance(part, list) else set()


def test_every_key_of_the_page_is_in_it():
    page = (ROOT / "docs" / "rack_yaml.md").read_text(encoding="utf-8")
    tables = re.findall(r"^\| (?:key|option) \| value \|.*\n\| ---.*\n((?:\|.*\n)+)", page, re.M)
    keys = {key for table in tables for key in re.findall(r"^\| `(\w+)` \|", table, re.M)}
    assert len(keys) > 25
    assert keys <= keys_of(json.loads(json.dumps(schema())))
    assert set(KEYS) <= keys


def test_every_kind_of_module_says_what_its_keys_take():
    for kind in KINDS:
        for key, what in kind.options.items():
            assert what["description"].endswith("."), (kind.word, key)


@pytest.mark.parametrize("model", SUPPORTED)
@pytest.mark.parametrize("form", ["{}", "B/M {}", "lower"])
def test_every_spelling_of_a_module_is_valid(model, form):
    text = model.lower() if form == "lower" else form.format(model)
    assert module_number(text) == model
    rack = f"rack: A\nslots:\n  0: {{module: {text}}}\n"
    assert refused(RACK, data_of(rack)) == []
    assert refused(RACK, data_of(rack.replace("module:", "modul:")))


def test_stimuli_know_the_verbs_of_a_rack():
    assert set(VERB_SCHEMAS) == set(rack_verbs(rack_at(FAULTY / "rack.yaml"), FAULTY / "a.yaml", allow_outside=False))


@pytest.mark.parametrize(
    "entry",
    [
        "{at: 1, sett: {A%: 1}}",
        "{at: 1}",
        "{set: {A%: 1}}",
        "{at: 1, set: {A%: 1}, run: [B]}",
        "{at: -1, run: [B]}",
        "{at: 1, ramp: {A%: {to: 3}}}",
        "{at: 1, ramp: {A%: {to: 3, over: 1, hz: 2}}}",
        "{at: 1, power: {off_for: 5, batery: true}}",
        "{at: 1, reload: {A: {keep_state: true}}}",
        "{at: 1, plant: {P: {shrt_scr: 3}}}",
        "{at: 1, plant: {P: {line_sag: {for_s: 3}}}}",
        "{at: 1, plant: {P: {line_noise: {seed: 3}}}}",
        "{at: 1, plant: {P: {line_harmonic: {order: 5, phase_deg: 3}}}}",
        "{at: 1, plant: {P: {generator_load: {dip_percent: 5}}}}",
        "{at: 1, plant: {P: {line_notches: {depth_percent: 5, wide: 3}}}}",
        "{at: 1, stop_all: false}",
    ],
)
def test_entries_of_another_form_are_refused(entry):
    assert refused(STIMULUS, data_of(f"- {entry}\n"))
