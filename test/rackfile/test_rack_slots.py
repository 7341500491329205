"""Which module may stand where (J2-3106-1 p. 10-2, J-3636 p. 1-1), checked against the rules said once more."""

from itertools import product

import pytest
from rack.helpers import codes, good, write

MEMORIES = ("57C413", "57C423")
PROCESSORS = ("57C430A", "57C431", "57C435")


def rack(modules: dict[int, str]) -> str:
    return "rack: A\nslots:\n" + "".join(f"  {slot}: {{module: {name}}}\n" for slot, name in modules.items())


def is_legal(modules: dict[int, str]) -> bool:
    """The rules, said once more."""
    processors = [slot for slot, name in modules.items() if name in PROCESSORS]
    memories = [slot for slot, name in modules.items() if name in MEMORIES]
    if any(slot % 2 for slot in memories) or not 1 <= len(processors) <= 4:
        return False
    if 0 in memories:
        return all(1 <= slot <= 4 for slot in processors)
    return processors == [0]


def test_every_arrangement_of_six_slots_is_judged_by_the_rules(tmp_path):
    for places in product((None, "57C413", "57C435"), repeat=6):
        modules = {slot: name for slot, name in enumerate(places) if name}
        if modules:
            assert (codes(tmp_path, rack(modules)) == []) == is_legal(modules), modules


@pytest.mark.parametrize("model", PROCESSORS)
def test_all_processors_are_known(tmp_path, model):
    assert good(tmp_path, rack({0: model})).task_modules[0].model == model


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("57C430", "AMX6204"),
        ("57C552", "AMX6202"),
        ("57C414", "AMX6203"),
        ("57C416B", "AMX6203"),
        ("57E435", "AMX6202"),
        ("'57C435 '", None),
        ("57c435", None),
        ("B/M 57C435", None),
        ("57C435A", None),
    ],
)
def test_numbers_as_faceplates_and_parts_lists_have_them(tmp_path, written, code):
    assert codes(tmp_path, rack({0: written})) == ([code] if code else [])


@pytest.mark.parametrize("slot", ["16", "-1", "1.0", "0x1", "A", "100000000000000000000"])
def test_slots_are_0_to_15(tmp_path, slot):
    assert codes(tmp_path, f"rack: A\nslots:\n  0: {{module: 57C435}}\n  {slot}: {{module: 57C413}}\n") == ["AMX6200"]


def test_ticks_are_half_milliseconds_from_half_to_ten(tmp_path):
    for tenths in range(111):
        text = f"rack: A\nslots:\n  0: {{module: 57C435, tick_ms: {tenths // 10}.{tenths % 10}}}\n"
        if tenths % 5 == 0 and 5 <= tenths <= 100:
            assert good(tmp_path, text).task_modules[0].tick_ns == tenths * 100_000
        else:
            assert codes(tmp_path, text) == ["AMX6210"]


@pytest.mark.parametrize("tick", ["1e0", "'5.5'", "five", "[5]", "", "1e999999999", "-5.5"])
def test_ticks_that_are_no_plain_numbers(tmp_path, tick):
    assert codes(tmp_path, f"rack: A\nslots:\n  0: {{module: 57C435, tick_ms: {tick}}}\n") == ["AMX6008"]


def test_unknown_module_hides_the_rules_it_may_satisfy(tmp_path):
    assert codes(tmp_path, rack({0: "57C314", 1: "57C435", 2: "57C435"})) == ["AMX6202"]


def test_common_memory_has_neither_tasks_nor_tick(tmp_path):
    text = "rack: A\nslots:\n  0: {module: 57C413, tick_ms: 5.5, tasks: {}}\n  1: {module: 57C435}\n"
    assert codes(tmp_path, text) == ["AMX6007", "AMX6007"]


def test_module_without_its_key_gets_a_hint(tmp_path):
    from automax_ros.rackfile.loader import load

    result = load(write(tmp_path, "rack: A\nslots:\n  0: 57C431\n"))
    assert [(item.code, item.hint) for item in result.diagnostics] == [("AMX6008", "write {module: 57C431}")]
