"""Include files of BASIC, written into the tasks that name them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.rackfile.old_plants.includes import include_files, include_reader, with_includes
from automax_ros.rackfile.old_plants.sources import convert

TASK = "10 COMMON A%\n20 {}\n90 END\n"


def included(statement, files):
    return with_includes(TASK.format(statement), files.get)


@pytest.mark.parametrize(
    "statement",
    ["INCLUDE HEAD", "INCLUDE 'HEAD.INC'", 'INCLUDE "C:\\AMXLIB\\HEAD.INC"', "include head.inc", "INCLUDE(HEAD)"],
)
def test_numbered_lines_take_the_place_of_the_statement(statement):
    found = included(statement, {"HEAD.INC": "30 LOCAL X%\r\n40 X% = &\r\n  1\r\n\x1aREST"})
    assert found.text == "10 COMMON A%\n20 ! INCLUDE HEAD.INC\n30 LOCAL X%\n40 X% = &\n  1\n90 END\n"
    assert (found.files, found.refused) == (["HEAD.INC"], [])


def test_lines_without_numbers_get_those_that_are_free():
    found = included("INCLUDE HEAD", {"HEAD.INC": "LOCAL X%\nX% = &\n  1\n"})
    assert found.text == "10 COMMON A%\n20 ! INCLUDE HEAD.INC\n21 LOCAL X%\n22 X% = &\n  1\n90 END\n"


def test_a_file_that_begins_with_the_number_of_the_statement_needs_no_remark():
    assert included("INCLUDE HEAD", {"HEAD.INC": "20 LOCAL X%\n"}).text == "10 COMMON A%\n20 LOCAL X%\n90 END\n"


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({}, "line 20 includes 'HEAD.INC': it is not next to the task"),
        ({"HEAD.INC": "30 A% = 1\n95 A% = 2\n"}, "its line numbers do not fit between 20 and 90"),
        ({"HEAD.INC": "5 A% = 1\n"}, "do not fit between 20 and 90"),
        ({"HEAD.INC": "40 A% = 1\n30 A% = 2\n"}, "do not fit"),
        ({"HEAD.INC": "A% = 1\n" * 80}, "do not fit"),
        ({"HEAD.INC": "20 INCLUDE HEAD\n"}, "it is included within too many others"),
    ],
)
def test_what_does_not_fit_stays_and_is_told(files, reason):
    found = included("INCLUDE HEAD", files)
    assert "INCLUDE HEAD" in found.text
    assert reason in found.refused[-1]


def test_include_files_may_include_others():
    files = {"HEAD.INC": "30 INCLUDE MORE\n40 A% = 2\n", "MORE.INC": "30 A% = 1\n"}
    assert included("INCLUDE HEAD", files).text.splitlines()[2:4] == ["30 A% = 1", "40 A% = 2"]


def test_texts_and_remarks_that_say_include_stay():
    text = "10 ! INCLUDE HEAD\n20 PRINT 'INCLUDE HEAD'\n30 INCLUDED% = 1\n"
    assert with_includes(text, lambda _: "1 END").text == text


def test_convert_inlines_what_lies_next_to_the_task(tmp_path):
    (tmp_path / "head.inc").write_bytes("30 ! GR\u00dcSSE\r\n".encode("latin-1"))
    result = convert(TASK.format("INCLUDE HEAD").encode(), lambda _: [], include_reader(include_files(tmp_path)))
    assert result.after == "10 COMMON A%\n20 ! INCLUDE HEAD.INC\n30 ! GR\u00dcSSE\n90 END\n"
    assert result.notes == ("HEAD.INC written in place of its INCLUDE",)
    assert convert(result.data, lambda _: [], include_reader(include_files(tmp_path))).changed is False


@given(st.text(alphabet="1234567890 INCLUDEHA.\n'&", max_size=80), st.text(alphabet="1230 INCLUDEA.\n&", max_size=60))
@settings(max_examples=150, deadline=None, derandomize=True, database=None)
def test_whatever_the_texts_it_ends(text, other):
    with_includes(text, lambda _: other)


def test_a_file_that_is_named_very_often_is_read_once_and_its_numbers_are_looked_at_once():
    """Each INCLUDE on its own would look at 40,000 lines, and at the rest of the task."""
    calls = []

    def read(name):
        calls.append(name)
        return "A% = 1\n" * 40_000

    found = with_includes("\n".join(f"{number} INCLUDE HEAD" for number in range(1, 20_001)), read)
    assert (calls, len(found.refused)) == (["HEAD.INC"], 20_000)


def test_include_files_together_have_a_bound():
    found = with_includes("10 INCLUDE A\n20 INCLUDE B\n30 INCLUDE C\n", lambda _: "!" + "x" * 1_100_000 + "\n")
    assert [reason.partition(": ")[2] for reason in found.refused][-2:] == [
        "the include files have more than 2000000 characters"
    ] * 2


def test_what_an_include_file_includes_fits_in_its_place_too():
    files = {"HEAD.INC": "30 INCLUDE MORE\n", "MORE.INC": "31 A% = 1\n95 A% = 2\n"}
    found = included("INCLUDE HEAD", files)
    assert found.refused == ["'MORE.INC' stays out: its line numbers do not fit between 30 and 90; renumber it"]


def test_include_files_are_those_of_the_folder_in_any_case(tmp_path):
    folder = tmp_path / "plant"
    folder.mkdir()
    (tmp_path / "SECRET.INC").write_text("30 ! SECRET\n")
    (folder / "OUT.INC").symlink_to(tmp_path / "SECRET.INC")
    (folder / "head.inc").write_bytes("30 ! GR\u00dcSSE\n".encode("utf-16"))
    read = include_reader(include_files(folder))
    assert (read("HEAD.INC"), read("OUT.INC")) == ("30 ! GR\u00dcSSE\n", None)
