"""The host: an iterator with close() that does what the compiler's generator does. Its C texts are written here."""

import gc
import sys
import sysconfig
import weakref

import pytest

from automax_ros.compile.base.native_source import NativeSource, NotNative
from automax_ros.compile.base.scan_io import ScanTooLong
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import native_form
from automax_ros.core.types import type_of_name
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import ViewSpec
from compile.native.support import exporting
from compile.support import compiled_of, task_of

TASK = """
10 COMMON REF%
20 COMMON RUN@
30 COMMON OUT%
40 COMMON LAMP@
50 COMMON GAIN
60 LOCAL COUNT%
70 LOCAL FLAG@
80 LOCAL WIDE!
90 LOCAL REST
100 LOCAL TABLE%(2)
200 CALL SCAN_LOOP(TICKS=2)
210 CALL SUMMER(INPUT1=REF%, INPUT2=0, OUTPUT=OUT%)
220 CALL AND(INPUT1=RUN@, INPUT2=RUN@, OUTPUT=LAMP@)
230 REST = GAIN
240 END
"""
FIELDS = ["COUNT%", "FLAG@", "WIDE!", "REST", "TABLE%"]
LATCHED = ("REF%", "RUN@", "OUT%", "LAMP@")
PASS = "o[0] = l[0]; o[1] = l[1];"


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return NativeCache(tmp_path_factory.mktemp("cache") / "native")


@pytest.fixture(scope="module")
def compiled() -> CompiledTask:
    made = compiled_of(TASK)
    assert ([field.name for field in made.layout.fields], made.latched) == (FIELDS, LATCHED)
    assert made.written == ("OUT%", "LAMP@")
    return made


class Io:
    """What a scan touches, with everything that it did."""

    def __init__(self, *latched):
        self.latched, self.done = latched, []
        self.memory = {4: 1.5, 0: 7}

    def latch(self):
        self.done.append("latch")
        return self.latched

    def commit(self, changes):
        self.done.append(("commit", changes))

    def read_now(self, view, element=0):
        self.done.append(("read", view, element))
        return self.memory[view]

    def write_now(self, view, value, element=0):
        self.done.append(("write", view, value, element))

    def log(self, line, code):
        self.done.append(("log", line, code))

    def errors_logged(self):
        return True

    def clear_errors(self):
        self.done.append("clear")

    def forces(self):
        return (False, True)

    def io_read(self, slot, register):
        return slot * 100 + register, 31

    def io_write(self, slot, register, value):
        self.done.append(("io_write", slot, register, value))
        return 32


def scans_of(compiled, cache, body, state, io, limits=(), forced=False):
    task = native_form(compiled, cache, lambda _: NativeSource("TASK", exporting(body), limits))
    return (task.scans_forced if forced else task.scans)(state, io)


def test_a_scan_latches_and_commits_what_differs(compiled, cache):
    io = Io(5, True, 3, True)
    scans = scans_of(compiled, cache, PASS, compiled.layout.fresh(), io)
    assert next(scans) is False
    assert io.done == ["latch", ("commit", [(2, 5)])]
    io.done.clear()
    io.latched = (5, True, 5, False)
    assert next(scans) is False
    assert io.done == ["latch", ("commit", [(3, True)])]
    assert io.done[1][1][0][1] is True
    io.done.clear()
    io.latched = (5, True, 5, True)
    assert next(scans) is False
    assert io.done == ["latch"]


def test_the_state_is_stored_when_the_scans_are_closed(compiled, cache):
    state = compiled.layout.fresh()
    body = PASS + "s[0].i += 1; s[1].i = 1; s[2].i -= 70000; s[3].d = -0.0; s[5].i = s[0].i;"
    scans = scans_of(compiled, cache, body, state, Io(0, False, 0, False))
    table = state[4]
    next(scans), next(scans)
    assert state == [0, False, 0, 0.0, [0, 0, 0]]
    scans.close()
    scans.close()
    assert list(map(repr, state)) == ["2", "True", "-140000", "-0.0", "[0, 2, 0]"]
    assert state[4] is table
    assert list(scans) == []


def test_what_no_scan_has_changed_stays_the_same_object(compiled, cache):
    state = compiled.layout.fresh()
    state[2] = wide = 123_456_789
    scans = scans_of(compiled, cache, PASS + "s[0].i = 1;", state, Io(0, False, 0, False))
    next(scans)
    scans.close()
    assert state[0] == 1
    assert state[2] is wide


def test_scans_that_never_began_leave_the_state_alone(compiled, cache):
    state = compiled.layout.fresh()
    scans = scans_of(compiled, cache, "s[0].i = 9;", state, Io(0, False, 0, False))
    scans.close()
    assert state == compiled.layout.fresh()
    with pytest.raises(StopIteration):
        next(scans)


def test_scans_that_are_dropped_store_the_state(compiled, cache):
    state = compiled.layout.fresh()
    scans = scans_of(compiled, cache, PASS + "s[0].i = 9;", state, Io(0, False, 0, False))
    next(scans)
    del scans
    assert state[0] == 9


def test_a_circle_of_io_and_scans_is_collected(compiled, cache):
    io, state = Io(0, False, 0, False), compiled.layout.fresh()
    io.scans = scans_of(compiled, cache, PASS + "s[0].i = 9;", state, io)
    next(io.scans)
    gone = weakref.ref(io)
    del io
    gc.collect()
    assert gone() is None
    assert state[0] == 9


def test_stop_commits_nothing_and_the_scans_go_on(compiled, cache):
    io, state = Io(5, True, 3, True), compiled.layout.fresh()
    scans = scans_of(compiled, cache, "s[0].i += 1; return AUTOMAX_STOPPED;", state, io)
    assert [next(scans), next(scans)] == [True, True]
    scans.close()
    assert (io.done, state[0]) == (["latch", "latch"], 2)


def test_a_scan_that_is_too_long_tells_the_line_and_stores_the_state(compiled, cache):
    state = compiled.layout.fresh()
    body = "s[0].i = 4; host->too_long_line = 230; return AUTOMAX_TOO_LONG;"
    scans = scans_of(compiled, cache, body, state, Io(0, False, 0, False))
    with pytest.raises(ScanTooLong) as error:
        next(scans)
    assert (error.value.line, state[0]) == (230, 4)
    assert list(scans) == []


def test_a_scan_that_python_would_end_by_an_exception_raises_one(compiled, cache):
    state = compiled.layout.fresh()
    scans = scans_of(compiled, cache, "s[0].i = 4; return 5;", state, Io(0, False, 0, False))
    with pytest.raises(ArithmeticError, match="has no value"):
        next(scans)
    assert state[0] == 4


TOUCHING = """
    automax_slot v; int64_t a, b;
    if (host->read(host, 4, 0, AUTOMAX_REAL, &v)) return AUTOMAX_BROKEN_OFF;
    s[3] = v; v.d = v.d * 2;
    if (host->write(host, 4, 1, AUTOMAX_REAL, v)) return AUTOMAX_BROKEN_OFF;
    v.i = 1;
    if (host->write(host, 1, 0, AUTOMAX_BOOLEAN, v)) return AUTOMAX_BROKEN_OFF;
    if (host->log(host, 230, 7020)) return AUTOMAX_BROKEN_OFF;
    if (host->errors_logged(host, &a)) return AUTOMAX_BROKEN_OFF;
    s[1].i = a;
    if (host->clear_errors(host)) return AUTOMAX_BROKEN_OFF;
    if (host->io_read(host, 3, 7, &a, &b)) return AUTOMAX_BROKEN_OFF;
    s[0].i = a; s[2].i = b;
    if (host->io_write(host, 3, 8, -5, &b)) return AUTOMAX_BROKEN_OFF;
    s[4].i = b;
    int64_t forced[2];
    if (host->forces(host, forced)) return AUTOMAX_BROKEN_OFF;
    s[5].i = forced[0]; s[6].i = forced[1];
    o[0] = l[2]; o[1] = l[3];
"""


def test_all_that_a_scan_may_touch(compiled, cache):
    io, state = Io(0, False, 0, False), compiled.layout.fresh()
    scans = scans_of(compiled, cache, TOUCHING, state, io, forced=True)
    assert next(scans) is False
    scans.close()
    assert io.done == [
        "latch",
        ("read", 4, 0),
        ("write", 4, 3.0, 1),
        ("write", 1, True, 0),
        ("log", 230, 7020),
        "clear",
        ("io_write", 3, 8, -5),
    ]
    assert io.done[3][2] is True
    assert state == [307, True, 31, 1.5, [32, 0, 1]]


@pytest.mark.parametrize("name", ["read_now", "write_now", "log", "errors_logged", "io_read", "forces", "latch"])
def test_an_exception_of_what_is_touched_ends_the_scans_with_the_state_stored(compiled, cache, name):
    class Fault(Exception):
        pass

    def fail(*_):
        raise Fault(name)

    io, state = Io(0, False, 0, False), compiled.layout.fresh()
    setattr(io, name, fail)
    scans = scans_of(compiled, cache, "s[4].i += 1;" + TOUCHING, state, io, forced=True)
    with pytest.raises(Fault, match=name):
        next(scans)
    assert state[4][0] == {"latch": 0, "forces": 32}.get(name, 1)
    with pytest.raises(StopIteration):
        next(scans)


@pytest.mark.parametrize("latched", [(5, True, 3), ("5", True, 3, True), None, (1 << 70, True, 3, True)])
def test_a_latch_of_other_values_is_an_error(compiled, cache, latched):
    io = Io()
    io.latched = latched
    with pytest.raises((ValueError, TypeError, OverflowError)):
        next(scans_of(compiled, cache, PASS, compiled.layout.fresh(), io))


def test_a_scan_cannot_be_closed_from_inside(compiled, cache):
    io = Io(5, True, 3, True)
    scans = scans_of(compiled, cache, PASS, compiled.layout.fresh(), io)
    io.commit = lambda _: scans.close()
    with pytest.raises(ValueError, match="a scan is being executed"):
        next(scans)


@pytest.mark.parametrize(
    ("position", "value"),
    [(0, 1.0), (0, 1 << 64), (0, True), (1, 1), (3, 2), (4, [0, 0]), (4, [0, 1.5, 0]), (2, 101)],
)
def test_a_state_that_c_cannot_hold_scans_in_python(compiled, cache, position, value):
    limits = ((-40000, 40000), (0, 1), (-100, 100), (0, 0), (-9, 9))
    state, other = compiled.layout.fresh(), compiled.layout.fresh()
    state[position] = other[position] = value
    io, python = Io(5, True, 3, True), Io(5, True, 3, True)
    scans = scans_of(compiled, cache, "s[0].i = 99; return AUTOMAX_STOPPED;", state, io, limits)
    expected = compiled.scans(other, python)
    assert next(scans) is next(expected) is False
    scans.close(), expected.close()
    assert list(map(repr, state)) == list(map(repr, other))
    assert io.done == python.done
    assert ("commit", [(2, 5)]) in io.done


def test_a_task_scans_natively_and_holds_variables_in_python(cache):
    task, memory = task_of(TASK, **{"REF%": 5})
    native = native_form(task.compiled, cache, lambda _: NativeSource("TASK", exporting(PASS + "s[0].i += 1;")))
    task.install(task.compiled.with_scans(native.scans, native.scans_forced))
    task.run()
    task.scan(0), task.scan(1)
    assert (task.value("COUNT%"), memory.read_now(2)) == (2, 5)
    task.hold({"COUNT%": 7})
    task.scan(2)
    assert task.value("COUNT%") == 7  # the text above would have counted on
    task.hold({})
    task.scan(3)
    assert task.value("COUNT%") == 8


def test_a_library_without_scans_is_not_native(compiled, cache):
    with pytest.raises(NotNative, match="native code cannot be loaded"):
        native_form(compiled, cache, lambda _: NativeSource("TASK", "int nothing;\n"))


def test_cells_are_read_again_when_they_hold_another_object(compiled, cache):
    """What latches cells looks at those that changed: a new value, or an equal one of another object or type."""
    memory = CommonMemory([ViewSpec(name, type_of_name(name)) for name in (*LATCHED, "GAIN")])
    task = native_form(compiled, cache, lambda _: NativeSource("TASK", exporting(PASS + "s[2].i += l[0].i;")))
    state, given, committed = compiled.layout.fresh(), 0, []

    class Cells:
        latch = memory.latching(memory.plan(range(len(LATCHED))))
        commit = staticmethod(committed.append)

    cells = Cells.latch.cells
    scans = task.scans(state, Cells())
    for value in (5, 5, 70_000, int("70000"), True, 1, -3, -3):
        cells[0] = value
        given += value
        next(scans)
        assert committed.pop() == [(2, value)]
    scans.close()
    assert state[2] == given


def test_objects_of_cells_are_given_back(compiled, cache):
    memory = CommonMemory([ViewSpec(name, type_of_name(name)) for name in (*LATCHED, "GAIN")])
    task = native_form(compiled, cache, lambda _: NativeSource("TASK", exporting(PASS)))
    first, second = int("123456789"), int("987654321")
    before = sys.getrefcount(first), sys.getrefcount(second)

    class Cells:
        latch = memory.latching(memory.plan(range(len(LATCHED))))

        @staticmethod
        def commit(_: object) -> None:
            """Drop it."""

    cells = Cells.latch.cells
    scans = task.scans(compiled.layout.fresh(), Cells())
    for which in (0, 1, 1, 0):
        cells[0] = (first, second)[which]
        next(scans)
    cells[0] = 0
    next(scans)
    assert (sys.getrefcount(first), sys.getrefcount(second)) == before
    cells[0] = first
    next(scans)
    scans.close()
    del scans
    cells[0] = 0
    assert sys.getrefcount(first) == before[0]


def test_without_a_compiler_nothing_is_translated(compiled, cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(NotNative, match="CC names no-such-compiler, which is not there"):
        native_form(compiled, cache, lambda _: pytest.fail("translated"))


def test_without_python_h_nothing_is_translated(compiled, cache, monkeypatch, tmp_path):
    monkeypatch.setattr(sysconfig, "get_path", lambda _: str(tmp_path))
    with pytest.raises(NotNative, match=r"Python\.h is missing"):
        native_form(compiled, cache, lambda _: pytest.fail("translated"))
