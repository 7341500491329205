"""Scans by columns: what goes in and comes out, with a C text of our own."""

import numpy as np
import pytest

from automax_ros.compile.base.native_source import NativeSource
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.columns import BesideLatch
from automax_ros.compile.native.run.task import native_form
from compile.base.test_host import TASK
from compile.native.support import exporting
from compile.support import compiled_of

COUNTING = "s[0].i += l[0].i; o[0].i = s[0].i; o[1].i = !l[1].i;"


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return NativeCache(tmp_path_factory.mktemp("cache") / "native")


@pytest.fixture(scope="module")
def compiled():
    return compiled_of(TASK)


def native_of(compiled, cache, body, limits=()):
    return native_form(compiled, cache, lambda _: NativeSource("TASK", exporting(body), limits))


def columns(count):
    return [np.arange(count), np.arange(count) % 2, np.zeros(count, np.int64), np.zeros(count, np.int64)]


def test_columns_go_in_and_come_out(compiled, cache):
    state = compiled.layout.fresh()
    done = native_of(compiled, cache, COUNTING).columns(state, columns(100), 100)
    assert (done.done, state[0], type(state[0])) == (100, 4950, int)
    assert done.outputs[0].tolist() == np.cumsum(np.arange(100)).tolist()
    assert done.outputs[1].tolist() == [1, 0] * 50
    assert (done.errors.shape, len(done.written.values)) == ((0, 3), 0)


def test_the_state_goes_on_from_block_to_block(compiled, cache):
    native, state, whole = native_of(compiled, cache, COUNTING), compiled.layout.fresh(), compiled.layout.fresh()
    native.columns(whole, columns(100), 100)
    for start in range(0, 100, 25):
        native.columns(state, [column[start:] for column in columns(100)], 25)
    assert state == whole


def test_the_state_is_that_before_a_scan_that_is_not_whole(compiled, cache):
    body = "if (l[0].i == 30) { s[0].i = 7777; s[5].i = 1; return AUTOMAX_STOPPED; }" + COUNTING + "s[4].i++;"
    state = compiled.layout.fresh()
    done = native_of(compiled, cache, body).columns(state, columns(100), 100)
    assert (done.done, state[0], state[4]) == (30, sum(range(30)), [30, 0, 0])
    assert len(done.outputs[0]) == 30


def test_errors_are_told_however_many_there_are(compiled, cache):
    body = "for (int n = 0; n < 50; n++) if (host->log(host, 230, 7000 + n)) return AUTOMAX_BROKEN_OFF;" + COUNTING
    state = compiled.layout.fresh()
    done = native_of(compiled, cache, body).columns(state, columns(100), 100)
    assert (done.done, state[0]) == (100, 4950)
    assert done.errors.tolist() == [[scan, 230, 7000 + n] for scan in range(100) for n in range(50)]


def test_a_state_that_c_cannot_hold_is_left_to_others(compiled, cache):
    state = compiled.layout.fresh()
    state[0] = 5
    done = native_of(compiled, cache, COUNTING, ((-4, 4),) * 5).columns(state, columns(10), 10)
    assert (done.done, state[0], [len(column) for column in done.outputs]) == (0, 5, [0, 0])


def test_no_scans_are_none(compiled, cache):
    state = compiled.layout.fresh()
    done = native_of(compiled, cache, COUNTING).columns(state, columns(0), 0)
    assert (done.done, state) == (0, compiled.layout.fresh())


def test_columns_that_do_not_fit_are_refused(compiled, cache):
    native, state = native_of(compiled, cache, COUNTING), compiled.layout.fresh()
    with pytest.raises(ValueError, match="3 columns where the task latches 4"):
        native.columns(state, columns(10)[:3], 10)
    with pytest.raises(ValueError, match="a column of 10 values for 11 scans"):
        native.columns(state, columns(10), 11)


@pytest.mark.parametrize(
    ("offsets", "rows"),
    [([0, 1], 1), ([0, 1, 3], 2), ([0, 2, 1], 2), ([-1, 0, 0], 2)],
)
def test_rows_that_would_be_read_past_their_end_are_refused(compiled, cache, offsets, rows):
    whole = np.zeros(rows, np.int64)
    actual = BesideLatch(np.array(offsets), whole, whole, np.zeros(rows))
    with pytest.raises(ValueError, match="do not fit 2 scans"):
        native_of(compiled, cache, COUNTING).columns(compiled.layout.fresh(), columns(2), 2, actual)
