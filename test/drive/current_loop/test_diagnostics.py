"""DIAG_DATA as the manual's 52.3.2 describes it: pages, records, NEXT_ENTRY."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.current_loop.outputs import PAGE_NUMBER, SIZE, next_entry_index, page_of, writes
from drive.support import repeatable

INTEGER = st.integers(-32768, 32767)


def element(row: int, page: int) -> int:
    """The index of an element, counted out over an array (37,1)."""
    return [(r, p) for r in range(38) for p in range(2)].index((row, page))


def test_the_array_has_the_manuals_size() -> None:
    assert element(37, 1) == SIZE - 1
    assert element(0, 0) == PAGE_NUMBER
    assert [next_entry_index(0), next_entry_index(1)] == [element(1, 0), element(1, 1)]


@pytest.mark.parametrize(("page_number", "page"), [(0, 0), (1, 1), (2, 1), (-1, 1), (32767, 1)])
def test_page_number_selects(page_number: int, page: int) -> None:
    assert page_of(page_number) == page


@pytest.mark.parametrize("page", [0, 1])
@pytest.mark.parametrize(
    ("next_entry", "rows", "then"),
    [(0, 2, 2), (1, 2, 2), (2, 5, 3), (11, 32, 12), (12, 35, 1), (13, 2, 2), (-1, 2, 2), (32767, 2, 2)],
)
def test_a_record_goes_where_next_entry_says(page: int, next_entry: int, rows: int, then: int) -> None:
    assert writes(page, next_entry, (101, 102, 103)) == (
        (element(rows, page), 101),
        (element(rows + 1, page), 102),
        (element(rows + 2, page), 103),
        (element(1, page), then),
    )


@repeatable
@given(INTEGER, INTEGER, st.lists(st.tuples(INTEGER, INTEGER, st.integers(0, 0x3F3F)), min_size=12, max_size=40))
def test_the_last_twelve_records_are_there_in_order(page_number, next_entry, records):
    """Whatever stood there: read from NEXT_ENTRY on, a full page has the last twelve; the other page is untouched."""
    page = page_of(page_number)
    array = [7777] * SIZE
    array[PAGE_NUMBER], array[next_entry_index(page)] = page_number, next_entry
    for record in records:
        for index, value in writes(page_of(array[PAGE_NUMBER]), array[next_entry_index(page)], record):
            array[index] = value
    oldest = array[next_entry_index(page)]
    order = [(oldest - 1 + step) % 12 for step in range(12)]
    found = [tuple(array[element(3 * n + 2 + word, page)] for word in range(3)) for n in order]
    assert found == records[-12:]
    assert array[PAGE_NUMBER] == page_number
    other = {element(row, 1 - page) for row in range(38)} - {PAGE_NUMBER}
    assert all(array[index] == 7777 for index in other)
