"""Text to value and back, one rule per data type (core/values.py)."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.numbers import stored_real
from automax_ros.core.ticks import seconds_ns, tick_ns
from automax_ros.core.types import DataType
from automax_ros.core.values import number, source_text, value_of, value_text, wanted, whole_number

INTEGER, DOUBLE, REAL, BOOLEAN, STRING = DataType


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (INTEGER, "100", 100),
        (INTEGER, " +100.0 ", 100),
        (INTEGER, "-32768", -32768),
        (INTEGER, "007", 7),
        (DOUBLE, "2147483647", 2147483647),
        (REAL, "100", 100.0),
        (REAL, "100.0", 100.0),
        (REAL, "1E3", 1000.0),
        (REAL, "-.5", -0.5),
        (REAL, "1e-30", 0.0),
        (BOOLEAN, "true", True),
        (BOOLEAN, "On", True),
        (BOOLEAN, "1", True),
        (BOOLEAN, "1.0", True),
        (BOOLEAN, "OFF", False),
        (BOOLEAN, " 0 ", False),
        (STRING, " as it stands ", " as it stands "),
        (STRING, "", ""),
    ],
)
def test_what_people_and_spreadsheets_write(kind, text, value):
    found = value_of(text, kind)
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        *((kind, text) for kind in (INTEGER, DOUBLE, REAL, BOOLEAN) for text in ("", " ", "1_0", "x", "0x1", "1,0")),
        *((kind, "\N{ARABIC-INDIC DIGIT ONE}") for kind in (INTEGER, DOUBLE, REAL, BOOLEAN)),
        (INTEGER, "32768"),
        (INTEGER, "1.5"),
        (INTEGER, "1E3"),
        (INTEGER, "TRUE"),
        (DOUBLE, "2147483648"),
        (REAL, "nan"),
        (REAL, "inf"),
        (REAL, "1e30"),
        (REAL, "1e99999"),
        (BOOLEAN, "2"),
        (BOOLEAN, "yes"),
        (STRING, "\udcff"),
        (STRING, "x" * 256),
    ],
)
def test_what_is_not_a_value(kind, text):
    assert value_of(text, kind) is None


def test_a_string_has_a_length():
    assert value_of("four", STRING, 4) == "four"
    assert value_of("fives", STRING, 4) is None
    assert wanted(STRING, 4) == "a text of at most 4 characters"


SINGLES = st.floats(width=32, allow_nan=False, allow_infinity=False).map(lambda value: stored_real(value)[0])


@given(value=st.integers(-32768, 32767))
def test_integers_come_back(value):
    assert value_of(value_text(value), INTEGER) == value
    assert value_of(f"{value}.0", DOUBLE) == value


@given(value=SINGLES)
def test_reals_come_back(value):
    found = value_of(value_text(value), REAL)
    assert isinstance(found, float)
    assert struct.pack("<f", found) == struct.pack("<f", value)
    assert source_text(value) == value_text(value)


@given(value=st.booleans())
def test_booleans_come_back_from_both_spellings(value):
    assert value_of(value_text(value), BOOLEAN) is value
    assert value_of(source_text(value), BOOLEAN) is value


@given(value=st.text(st.characters(codec="utf-8"), max_size=255))
def test_strings_come_back(value):
    assert value_of(value_text(value), STRING) == value


@given(kind=st.sampled_from(DataType), text=st.text(max_size=40) | st.from_regex(r"[-+]?[0-9._eE]{0,12}"))
def test_any_text_is_a_value_of_its_type_or_none(kind, text):
    value = value_of(text, kind)
    if value is None:
        return
    assert type(value) is type(kind.zero)
    assert value_of(value_text(value), kind) == value
    assert isinstance(value, str) or not isinstance(value, float) or abs(value) <= 9.2233720e18


@pytest.mark.parametrize("text", ["1_0", "\N{ARABIC-INDIC DIGIT ONE}", "nan", "inf", "", "1e", "--1", "0x10", "9" * 99])
def test_numbers_have_one_spelling_everywhere(text):
    for reader in (number, whole_number, seconds_ns, tick_ns):
        with pytest.raises(ValueError, match=r"is not a (whole )?number"):
            reader(text)
