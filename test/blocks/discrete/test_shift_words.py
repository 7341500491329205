"""SHIFT_WORDS (section 31), and ``Columns``: the model of a data structure that other tests use too."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import int16, repeatable, run


class Columns:
    """A data structure as the manual tells of it: a list of columns that really moves."""

    def __init__(self, columns, channels, empty):
        self.empty = [empty] * channels
        self.columns = [self.empty] * columns
        self.shifts = 0

    def reset(self):
        """All data is zeroed."""
        self.columns = [self.empty] * len(self.columns)
        self.shifts = 0

    def shift(self, column):
        """Move every column on, load column 0, and return the last column."""
        self.columns = [list(column), *self.columns[:-1]]
        self.shifts += 1
        return self.columns[-1]

    def exists(self, number):
        return 0 <= number < len(self.columns)

    def loaded(self, number):
        return self.exists(number) and self.shifts > number

    def write(self, number, given):
        """Put values by channel, from 1 on, into a column."""
        column = list(self.columns[number])
        for channel, value in given.items():
            column[channel - 1] = value
        self.columns[number] = column

    @property
    def valid(self):
        """DATA_VALID."""
        return self.shifts >= len(self.columns)


class Shifter:
    """A SHIFT block and its model; ``shown`` are its data outputs."""

    def __init__(self, name, columns, channels=1, **literals):
        self.block = run(name, max_columns=columns, channels=channels, **literals)
        empty = False if name == "SHIFT_BITS" else 0
        self.model = Columns(columns, channels, empty)
        self.shown = [empty] * channels

    def scan(self, values, *, shift=True, reset=False, enable=True, foreign=None):
        """Scan the block and compare it with the model; ``foreign``: what another writer put on the outputs before."""
        if foreign is not None:
            self.shown = foreign
            self.block.outputs.update({f"output{channel}": value for channel, value in enumerate(foreign, 1)})
        inputs = {f"input{channel}": value for channel, value in enumerate(values, 1)}
        result = self.block.scan(shift=shift, reset=reset, enable=enable, **inputs)
        if reset:
            self.model.reset()
            self.shown = self.model.empty
        elif shift:
            self.shown = self.model.shift(values if enable else self.model.empty)
        outputs = [result[f"output{channel}"] for channel in range(1, len(self.shown) + 1)]
        assert outputs == list(self.shown)
        assert [type(value) for value in outputs] == [type(value) for value in self.model.empty]
        assert result["data_valid"] is self.model.valid
        assert self.block.error == 0
        return outputs


def first_outputs(block, rows):
    """OUTPUT1 and DATA_VALID of a scan for each row."""
    results = [block.scan(**row) for row in rows]
    return [result["output1"] for result in results], [result["data_valid"] for result in results]


def test_what_enters_leaves_max_columns_less_one_shifts_later():
    block = run("SHIFT_WORDS", max_columns=4, channels=1)
    outputs, valid = first_outputs(block, [{"shift": True, "input1": value} for value in (11, -22, 33, 44, 55, 66)])
    assert outputs == [0, 0, 0, 11, -22, 33]
    assert valid == [False, False, False, True, True, True]


def test_a_single_column_passes_its_input_through():
    block = run("SHIFT_WORDS", max_columns=1, channels=1)
    outputs, valid = first_outputs(block, [{"shift": True, "input1": value} for value in (7, -32768, 32767)])
    assert outputs == [7, -32768, 32767]
    assert valid == [True, True, True]


def test_without_shift_nothing_moves():
    block = run("SHIFT_WORDS", max_columns=2, channels=1)
    rows = [(True, 1), (False, 2), (False, 3), (True, 4), (False, 5), (True, 6)]
    outputs, valid = first_outputs(block, [{"shift": shift, "input1": value} for shift, value in rows])
    assert outputs == [0, 0, 0, 1, 1, 4]
    assert valid == [False, False, False, True, True, True]


def test_without_enable_zeros_are_shifted_in_and_count_as_data():
    block = run("SHIFT_WORDS", max_columns=2, channels=2)
    for enable, expected in ((True, (0, 0)), (False, (5, 6)), (True, (0, 0)), (True, (5, 6))):
        result = block.scan(shift=True, enable=enable, input1=5, input2=6)
        assert (result["output1"], result["output2"]) == expected
    assert result["data_valid"]


def test_reset_wins_over_shift_and_zeroes_data_and_outputs():
    shifter = Shifter("SHIFT_WORDS", 3, 2)
    for value in (1, 2, 3, 4):
        shifter.scan([value, -value])
    assert shifter.scan([9, 9], reset=True) == [0, 0]
    assert shifter.scan([9, 9], reset=True, shift=False) == [0, 0]
    assert [shifter.scan([value, value]) for value in (7, 8, 9)] == [[0, 0], [0, 0], [7, 7]]


def test_data_valid_counts_the_shifts_since_reset():
    block = run("SHIFT_WORDS", max_columns=3, channels=1)
    rows = [{"shift": True, "reset": number == 4} for number in range(9)]
    valid = [block.scan(input1=0, **row)["data_valid"] for row in rows]
    assert valid == [False, False, True, True, False, False, False, True, True]


def test_another_writer_keeps_what_it_wrote_until_a_shift_or_a_reset():
    block = run("SHIFT_WORDS", max_columns=1, channels=2)
    block.scan(shift=True, input1=3, input2=4)
    block.outputs["output1"] = 99
    result = block.scan(shift=False, input1=5, input2=6)
    assert (result["output1"], result["output2"]) == (99, 4)
    result = block.scan(shift=True, input1=5, input2=6)
    assert (result["output1"], result["output2"]) == (5, 6)
    block.outputs["output2"] = -99
    result = block.scan(shift=False, reset=True, input1=5, input2=6)
    assert (result["output1"], result["output2"]) == (0, 0)


@pytest.mark.parametrize(("channels", "columns"), [(1, 16383), (8, 2047)])
def test_the_largest_structures(channels, columns):
    """2 bytes x channels x columns may be 32767 at most (note 3)."""
    block = run("SHIFT_WORDS", max_columns=columns, channels=channels)
    names = [(f"input{channel}", f"output{channel}") for channel in range(1, channels + 1)]
    for scan in range(1, columns + 200):
        result = block.scan(shift=True, **{entry: 3 * scan + number for number, (entry, _) in enumerate(names)})
        first = 3 * (scan - columns + 1) if scan >= columns else None
        expected = [0 if first is None else first + number for number in range(channels)]
        assert [result[leaving] for _, leaving in names] == expected


def test_data_valid_stays_over_more_shifts_than_a_16_bit_count_holds():
    block = run("SHIFT_WORDS", max_columns=2, channels=1)
    block.scan(shift=True, input1=1)
    assert all(block.scan(shift=True, input1=1)["data_valid"] for _ in range(66_000))


@pytest.mark.parametrize("columns", [0, -1, 32768])
def test_max_columns_out_of_range_is_refused(columns):
    with pytest.raises(InstanceError):
        run("SHIFT_WORDS", max_columns=columns)


@pytest.mark.parametrize(("name", "value"), [("SHIFT_BITS", st.booleans()), ("SHIFT_WORDS", int16)])
@repeatable
@given(st.integers(1, 6), st.integers(1, 8), st.data())
def test_against_a_list_of_columns(name, value, columns, channels, data):
    shifter = Shifter(name, columns, channels)
    values = st.lists(value, min_size=channels, max_size=channels)
    likely = st.integers(0, 5).map(bool)
    rows = st.tuples(values, likely, likely, likely, st.none() | values)
    for column, shift, enable, kept, foreign in data.draw(st.lists(rows, max_size=40)):
        shifter.scan(column, shift=shift, enable=enable, reset=not kept, foreign=foreign)
