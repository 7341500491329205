"""What `automax ctl` calls of a rack for the words that a user writes."""

import argparse
import importlib
import inspect
from types import SimpleNamespace

import pytest
from system.support import RACKS

from automax_ros.cli.operate.actions import ACTIONS
from automax_ros.cli.options.ros import space_of
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.rack.operator.requests import VERBS


def asked(action: str, *words: str) -> list[dict[str, object]]:
    parser = argparse.ArgumentParser()
    ACTIONS[action].add_arguments(parser)
    return [dict(call.fields) for call in ACTIONS[action].calls(parser.parse_args(words))]


def test_all_means_all_as_in_stimuli():
    assert asked("unforce", "all") == asked("unforce", "--all") == [{"names": []}]
    assert asked("clear", "all") == asked("clear") == [{"task": ""}]
    assert asked("unforce", "A%", "ALL") == [{"names": ["A%", "ALL"]}]
    assert asked("clear", "ONE", "TWO") == [{"task": "ONE"}, {"task": "TWO"}]


@pytest.mark.parametrize("words", [(), ("--all", "A%")])
def test_unforce_wants_names_or_all(words):
    with pytest.raises(UsageError, match="takes names, or --all"):
        asked("unforce", *words)


def test_what_is_found_in_a_sent_source_is_named_by_the_file_that_was_given(tmp_path):
    file = tmp_path / "edited.blk"
    file.write_text("10 END\n")
    parser = argparse.ArgumentParser()
    ACTIONS["reload"].add_arguments(parser)
    (call,) = ACTIONS["reload"].calls(parser.parse_args(["speed", str(file)]))
    found = "SPEED.BLK:1:1: error[AMX2001]: END\n  1 | 10 END\nSPEED.BLK:2:3: note: here"
    assert call.reword(found) == f"{file}:1:1: error[AMX2001]: END\n  1 | 10 END\n{file}:2:3: note: here"
    assert call.reword("SPEED.BLK has errors: task SPEED") == f"{file} has errors: task SPEED"
    assert call.reword("sd/LINE.BLK:1:1: error") == "sd/LINE.BLK:1:1: error"


def test_a_rack_is_named_by_its_folder_as_well_as_by_its_file(tmp_path, monkeypatch):
    assert space_of(str(RACKS / "operated")) == space_of(str(RACKS / "operated" / "rack.yaml")) == "/operated"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "PM1").mkdir()
    assert space_of("PM1") == "/pm1"
    (tmp_path / "PM1" / "rack.yaml").write_text((RACKS / "operated" / "rack.yaml").read_text())
    for name in ("LINE.BLK", "SPEED.BLK"):
        (tmp_path / "PM1" / name).write_text((RACKS / "operated" / name).read_text())
    assert space_of("PM1") == "/operated"
    with pytest.raises(UsageError, match="is a task"):
        space_of("PM1/LINE.BLK")


@pytest.mark.parametrize("action", ["module", "plant"])
def test_controls_take_the_words_of_stimuli(action):
    for words, value in (
        (("UNWIND", "load_torque_nm", "-20.5"), "-20.5"),
        (("7", "fault_reset_switch"), "true"),
        (("UNWIND", "line_sag", "70", "0.2"), "70 0.2"),
    ):
        assert asked(action, *words) == [{"name": words[0], "control": words[1], "value": value}]


def test_a_web_that_is_broken_takes_no_value():
    assert asked("web", "W1", "break") == [{"name": "W1", "control": "break", "value": ""}]
    assert asked("web", "W1", "stiffness_n", "1.5e5") == [{"name": "W1", "control": "stiffness_n", "value": "1.5e5"}]


def test_steps_and_power_are_asked_for_as_the_services_take_them():
    assert asked("step") == [{"what": "scan", "task": "", "count": 1}]
    assert asked("step", "tick", "SPEED", "--count", "3") == [{"what": "tick", "task": "SPEED", "count": 3}]
    assert asked("step", "until", "12.5") == [{"what": "until", "until_s": 12.5}]
    assert asked("power", "off") == [{"what": "off", "off_for_s": 0.0, "without_battery": False}]
    assert asked("power", "cycle", "--off-for", "2.5", "--without-battery") == [
        {"what": "cycle", "off_for_s": 2.5, "without_battery": True}
    ]


@pytest.mark.parametrize("name", ACTIONS)
def test_every_action_asks_a_service_with_fields_that_it_has(name, tmp_path):
    """What is sent is what msg_defs/ defines; the rack serves it (test_operator)."""
    pytest.importorskip("automax_msgs.srv")
    (tmp_path / "T.BLK").write_text("10 END\n")
    words = {
        "reload": ("T", str(tmp_path / "T.BLK")),
        "plant": ("UNWIND", "repair", "all"),
        "module": ("7", "test_switch", "A"),
        "web": ("W1", "break"),
        "power": ("on",),
        "lifecycle": ("activate",),
        "press": ("A@",),
        "unforce": ("--all",),
    }
    assigned, named = {"set", "force", "tune"}, {"run", "stop", "delete", "get", "watch"}
    given = words.get(name) or (("A%=1",) if name in assigned else ("A",) if name in named else ())
    parser = argparse.ArgumentParser()
    ACTIONS[name].add_arguments(parser)
    for call in ACTIONS[name].calls(parser.parse_args(list(given))):
        package, _, kind = call.type_name.partition("/")
        assert getattr(importlib.import_module(f"{package}.srv"), kind).Request(**call.fields)
        assert not ACTIONS[name].by_operator or VERBS[call.service].type_name == call.type_name


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_takes_the_fields_of_its_request(name):
    """A node passes them on by their names."""
    pytest.importorskip("automax_msgs.srv")
    package, _, kind = VERBS[name].type_name.partition("/")
    request = getattr(importlib.import_module(f"{package}.srv"), kind).Request
    fields = dict.fromkeys(request.get_fields_and_field_types())
    for function in (VERBS[name].act, VERBS[name].now):
        inspect.signature(function).bind(None, **fields)


def test_an_answer_with_more_names_than_values_is_an_error_and_no_traceback():
    """Our racks answer one for each; a stranger may serve the same service."""
    answer = SimpleNamespace(found=["REF%", "OUT%"], values=["1"])
    for action in ("get", "watch", "forces"):
        with pytest.raises(UserError, match="the rack answers with 2 names and 1 value"):
            ACTIONS[action].read(answer)
