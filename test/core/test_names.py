"""Names with subscripts: which element they mean, and back."""

from dataclasses import dataclass
from math import prod

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.names import (
    Element,
    UnknownName,
    WrongSubscripts,
    element,
    element_name,
    flat_index,
    subscripts_of,
)


@dataclass(frozen=True)
class Named:
    name: str
    dimensions: tuple[int, ...] = ()


REF, TABLE, GRID = Named("REF%"), Named("TABLE%", (11,)), Named("GRID", (2, 3))
KNOWN = {item.name: item for item in (REF, TABLE, GRID)}


def meant(text: str) -> Element[Named]:
    return element(text, KNOWN, "the task has no variable")


@pytest.mark.parametrize(
    ("text", "variable", "index", "label"),
    [
        ("REF%", REF, 0, "REF%"),
        (" r e f % ", REF, 0, "REF%"),
        ("table%( 3 )", TABLE, 3, "TABLE%(3)"),
        ("TABLE%[010]", TABLE, 10, "TABLE%(10)"),
        ("grid[1, 2]", GRID, 5, "GRID(1,2)"),
        ("GRID(1,2]", GRID, 5, "GRID(1,2)"),
    ],
)
def test_case_blanks_and_brackets_do_not_matter(text, variable, index, label):
    found = meant(text)
    assert (found.variable, found.index, found.label, found.name) == (variable, index, label, variable.name)


@pytest.mark.parametrize(
    ("text", "kind", "message", "hint"),
    [
        ("REFF%", UnknownName, "the task has no variable 'REFF%'", "did you mean REF%?"),
        ("REF", UnknownName, "the task has no variable 'REF'", "did you mean REF%?"),
        ("GRID%(1,2)", UnknownName, "the task has no variable 'GRID%(1,2)'", "did you mean GRID?"),
        ("", UnknownName, "the task has no variable ''", "it has REF%, TABLE%, GRID"),
        ("REF\N{FULLWIDTH PERCENT SIGN}", UnknownName, "the task has no variable", None),
        ("TABLE%(\N{ARABIC-INDIC DIGIT THREE})", UnknownName, "the task has no variable", "did you mean TABLE%?"),
        ("TABLE%(-1)", UnknownName, "the task has no variable 'TABLE%(-1)'", "did you mean TABLE%?"),
        ("TABLE%", WrongSubscripts, "TABLE% is an array", "name one element; the last is TABLE%(10)"),
        ("GRID(1)", WrongSubscripts, "GRID has 2 subscripts, not 1", "name one element; the last is GRID(1,2)"),
        ("TABLE%(11)", WrongSubscripts, "subscript 11 of TABLE%(11) is out of range", "the largest is 10"),
        ("REF%(0)", WrongSubscripts, "REF% is not an array", "write REF%"),
    ],
)
def test_what_is_not_there_is_told_with_what_is(text, kind, message, hint):
    with pytest.raises(kind) as caught:
        meant(text)
    assert message in caught.value.message
    assert hint is None or caught.value.hint == hint


def test_a_rack_without_variables_has_none_to_offer():
    with pytest.raises(UnknownName) as caught:
        element("REF%", {}, "the rack has no common variable")
    assert caught.value.hint is None


@given(data=st.data(), dimensions=st.lists(st.integers(1, 6), max_size=4))
def test_index_and_subscripts_are_each_others_inverse(data, dimensions):
    index = data.draw(st.integers(0, prod(dimensions) - 1))
    subscripts = subscripts_of(index, dimensions)
    assert all(0 <= subscript < size for subscript, size in zip(subscripts, dimensions, strict=True))
    assert flat_index(subscripts, dimensions) == index
    variable = Named("A%", tuple(dimensions))
    assert element(element_name(variable, index), {"A%": variable}, "") == Element(variable, index)


def test_last_subscript_runs_fastest():
    assert [subscripts_of(index, (2, 3)) for index in range(6)] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]


@given(text=st.text(max_size=30) | st.from_regex(r"[A-Za-z%!@$ ]{0,8}[(\[][0-9, ]{0,12}[)\]]"))
def test_any_text_names_an_element_or_is_refused(text):
    try:
        found = meant(text)
    except (UnknownName, WrongSubscripts):
        return
    assert meant(found.label) == found
