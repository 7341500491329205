"""Pieces of text for messages."""

import pytest

from automax_ros.core.text import MAX_COMPARISONS, Suggester, did_you_mean, near_or_listed, quoted, table


@pytest.mark.parametrize(
    ("word", "known", "hint"),
    [
        ("REFF%", ("REF%", "RUN@"), "did you mean REF%?"),
        ("REF", ("REF@", "REFF"), "did you mean REF@?"),
        ("prop_imt", ("PROP_INT", "PID"), "did you mean PROP_INT?"),
        ("XYZZY", ("REF%", "RUN@"), None),
        ("REF%", (), None),
        ("X" * 10_000, ("X" * 10_000,), None),
    ],
)
def test_nearest_word(word, known, hint):
    assert did_you_mean(word, known) == hint


def test_nearest_words_do_not_depend_on_their_order():
    assert did_you_mean("B", {"A", "B@", "B%", "C"}) == "did you mean B%?"
    assert did_you_mean("B", ["B%", "B@"], most=2) == "did you mean B% or B@?"


def test_words_that_are_not_near_are_listed():
    assert near_or_listed("XYZZY", [f"A{number}" for number in range(9)]) == "it has A0, A1, A2, A3, A4, A5, A6, A7 ..."
    assert near_or_listed("A", ["AB"], "TASK.") == "did you mean TASK.AB?"
    assert near_or_listed("XYZZY", []) is None


def test_search_ends_where_its_budget_does():
    suggester = Suggester()
    known = [f"NAME{number}" for number in range(MAX_COMPARISONS)]
    assert suggester.nearest("NAMEE1", known) is not None
    assert suggester.nearest("NAMEE1", known) is None


def test_quoted_text_drives_no_terminal():
    assert quoted("\x1b[2J" + "x" * 100) == "'\ufffd[2J" + "x" * 33 + "...'"


def test_columns_are_aligned():
    assert table([("name", "count"), ("a", "7"), ("longer name",)], right={1}) == [
        "name         count",
        "a                7",
        "longer name",
    ]
    assert table([]) == []
