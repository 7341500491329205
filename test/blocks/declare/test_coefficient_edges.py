"""Every limit of sections 41 to 50, from both sides: a literal in a task, a variable while the block runs."""

import math
import re
from dataclasses import dataclass

import pytest
from compile.support import task_of
from language.check_support import problems

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Severity
from automax_ros.core.numbers import stored_real
from blocks.support import TICK, mapping_constant, run

STEP = 1e-6
"""How far off a limit is still inside, and how far is outside, relative: some 16 times the resolution of a REAL."""
LIMITED = 7004
TICKS = 4
PI = math.pi
FEW = [n * 5 % 7 - 3 for n in range(50)]
INPUTS = FEW + [32767 if n % 50 < 40 else -9000 for n in range(140)] + FEW
"""Some counts, which a large gain does not clip, between them much, which a small one needs."""


@dataclass(frozen=True)
class Edge:
    """A parameter's limits as functions of T in s; ``others`` are the other parameters of the CALL as text."""

    block: str
    parameter: str
    low: object
    high: object
    others: str

    def __str__(self):
        return f"{self.block}-{self.parameter}-{self.others}"

    @property
    def target(self):
        on_udc = self.block in ("HIGH_PASS_FILTER", "LOW_PASS_FILTER", "NOTCHN")
        return Platform.UDC if on_udc else Platform.AUTOMAX

    def bounds(self, period_s):
        """The limits that the manual states: (side, value, factor that leads outside)."""
        found = []
        if self.low is not None:
            found.append(("low", self.low(period_s), 1 - STEP))
        if self.high is not None:
            found.append(("high", self.high(period_s), 1 + STEP))
        return found

    def problems(self, value, ticks, tick_ns):
        """The errors of a task that gives the parameter as a constant."""
        found = problems(self.text(f"{value:.7E}", ticks, tick_ns), target=self.target, tick_ns=tick_ns)
        return [item for item in found if item.severity is Severity.ERROR]

    def text(self, value, ticks, tick_ns):
        """A task with that value, a constant or a variable's name, as the parameter."""
        inputs = "INPUT=A%, FEEDBACK=C%" if self.block == "PID" else "INPUT=A%"
        others = self.others.format(T=Written(ticks * tick_ns))
        call = f"CALL {self.block}({inputs}, {self.parameter}={value}, {others}, OUTPUT=B%)"
        return f"10 LOCAL A%, B%, C%, R\n20 CALL SCAN_LOOP(TICKS={ticks})\n30 {call}\n40 END\n"

    def instance(self, ticks, tick_ns):
        """The block with the literals of the others, and those that are variables there."""
        period_ns = ticks * tick_ns
        literals, variables = {}, {}
        for item in self.others.format(T=Written(period_ns)).split(", "):
            name, text = item.split("=")
            if text == "R":
                variables[name.lower()] = 10.0 if self.block != "NOTCH" else 1.0
            else:
                literals[name.lower()] = int(text) if "." not in text else float(text)
        return run(self.block, period_ns, **literals), variables


class Written:
    """T as a divisor in a text of parameters: ``{T:2.0}`` is 2 / T as a constant."""

    def __init__(self, period_ns):
        self.period_s = period_ns / 1e9

    def __format__(self, factor):
        return f"{float(factor) / self.period_s:.7E}"


def constant(value):
    return lambda _: value


def per_t(factor):
    return lambda t: factor / t


def times_c(factor, wm_t=None):
    """Factor x C, for a WM T in radians."""
    return lambda t: factor * mapping_constant(t, None if wm_t is None else wm_t / t)


TINY = 2.0**-18
FASTEST = 2 * PI / 4.5
AUTOMAX_EDGES = [
    *(
        edge
        for block in ("DIFF_LAG", "LAG")
        for edge in (
            Edge(block, "WM", per_t(2.0**-17), per_t(FASTEST), "WLG=R"),
            Edge(block, "WLG", times_c(TINY), times_c(0.71), "INITIAL_VALUE=0"),
            Edge(block, "WLG", times_c(TINY, 1.0), times_c(0.71, 1.0), "WM={T:1.0}"),
        )
    ),
    Edge("INTEGRATE", "WM", constant(0.01), per_t(0.9 * PI), "KI=R"),
    Edge("INTEGRATE", "KI", times_c(TINY), per_t(0.9 * PI), "INITIAL_VALUE=0"),
    Edge("INTEGRATE", "KI", times_c(TINY, 2.5), per_t(0.9 * PI), "WM={T:2.5}"),
    Edge("LEAD_LAG", "WM", constant(0.001), per_t(FASTEST), "WLD=R, WLG=R"),
    Edge("LEAD_LAG", "WLD", constant(0.001), None, "WLG=0.005"),
    Edge("LEAD_LAG", "WLD", None, per_t(FASTEST), "WLG={T:0.3}"),
    Edge("LEAD_LAG", "WLG", constant(0.001), None, "WLD=0.005"),
    Edge("LEAD_LAG", "WLG", None, per_t(FASTEST), "WLD={T:0.3}"),
    Edge("NOTCH", "Q_FACTOR", constant(0.5), constant(100.0), "WN={T:0.5}"),
    Edge("NOTCH", "WN", constant(0.01), per_t(2 * PI / 10), "Q_FACTOR=2.0"),
    Edge("PROP_INT", "WM", per_t(2.0**-17), per_t(0.9 * PI), "KP=R, WLD=R"),
    Edge("PROP_INT", "WLD", times_c(TINY / 0.5), per_t(0.9 * PI), "KP=0.5"),
    Edge("PROP_INT", "WLD", times_c(TINY / 4.0, 0.1), per_t(0.9 * PI), "KP=4.0, WM={T:0.1}"),
    Edge("PROP_INT", "KP", constant(0.001), constant(128.0), "WLD={T:0.5}"),
]
UDC_EDGES = [
    *(
        Edge(block, parameter, per_t(low), per_t(0.999 * PI), f"ORDER={order}")
        for block, parameter in (("HIGH_PASS_FILTER", "WLD"), ("LOW_PASS_FILTER", "WLG"))
        for order, low in ((1, 0.000004), (2, 0.02), (3, 0.1))
    ),
    Edge("HIGH_PASS_FILTER", "WLD", per_t(0.000004), None, "INITIAL_VALUE=0"),
    Edge("LOW_PASS_FILTER", "WLG", per_t(0.000004), None, "INITIAL_VALUE=0"),
    Edge("NOTCHN", "WN", per_t(0.02), per_t(0.999 * PI), "Q_FACTOR=2.0, ORDER=2"),
    Edge("NOTCHN", "WN", per_t(0.3), per_t(0.999 * PI), "Q_FACTOR=2.0, ORDER=4"),
    Edge("NOTCHN", "WN", per_t(0.02), None, "Q_FACTOR=2.0"),
    Edge("NOTCHN", "Q_FACTOR", constant(0.5), constant(100.0), "WN={T:0.5}"),
]
SCAN_TIMES = [(1, 5_500_000), (4, 5_500_000), (13, 3_000_000), (2, 500_000), (30, 10_000_000)]
UDC_SCAN_TIMES = [(1, 500_000), (7, 500_000), (20, 500_000)]
EDGES = [
    pytest.param(edge, *scan_time, id=f"{edge}-{scan_time[0]}x{scan_time[1] / 1e6}ms")
    for edges, scan_times in ((AUTOMAX_EDGES, SCAN_TIMES), (UDC_EDGES, UDC_SCAN_TIMES))
    for edge in edges
    for scan_time in scan_times
]
VARIABLE_EDGES = [item for item in EDGES if item.values[0].parameter != "WM"]


def stated(text):
    """The numbers in a message."""
    return [float(number) for number in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", text)]


@pytest.mark.parametrize(("edge", "ticks", "tick_ns"), EDGES)
def test_a_constant_beside_its_limit(edge, ticks, tick_ns):
    """Just inside compiles; just outside is one error, which states the limit to 6 digits."""
    for side, bound, outward in edge.bounds(ticks * tick_ns / 1e9):
        assert edge.problems(bound / outward, ticks, tick_ns) == []
        found = edge.problems(bound * outward, ticks, tick_ns)
        assert [item.code for item in found] == ["AMX4084"]
        assert edge.parameter in found[0].message
        assert side in found[0].message
        assert any(number == pytest.approx(bound, rel=1e-6) for number in stated(found[0].message))


@pytest.mark.parametrize(("edge", "ticks", "tick_ns"), VARIABLE_EDGES)
def test_a_variable_beside_its_limit_is_logged_when_it_leaves(edge, ticks, tick_ns):
    """Once, and again after it came back and left again."""
    name = edge.parameter.lower()
    for _, bound, outward in edge.bounds(ticks * tick_ns / 1e9):
        block, variables = edge.instance(ticks, tick_ns)
        inside, outside = bound / outward, bound * outward
        errors = []
        for value in (inside, outside, outside, outside * outward, inside, inside, outside, inside):
            block.scan(input=100, **{name: value}, **variables)
            errors.append(block.error)
        assert errors == [0, LIMITED, 0, 0, 0, 0, LIMITED, 0]
        block, variables = edge.instance(ticks, tick_ns)
        block.scan(input=100, **{name: outside}, **variables)
        assert block.error == LIMITED


@pytest.mark.parametrize("edge", [item for item in (*AUTOMAX_EDGES, *UDC_EDGES) if item.parameter != "WM"], ids=str)
def test_a_compiled_task_logs_a_variable_that_leaves(edge):
    """The same with a REAL variable of a running task, which holds 24 bits."""
    for _, bound, outward in edge.bounds(TICKS * TICK / 1e9):
        running, _ = task_of(edge.text("R", TICKS, TICK), target=edge.target)
        running.run()
        running.record_scans()
        logs = []
        for value in (bound / outward, bound * outward, bound * outward, bound / outward, bound * outward):
            running.state[running.compiled.layout.index("R")] = stored_real(value)[0]
            logs.append([code for _, code in running.scan(0).errors])
        assert logs == [[], [LIMITED], [], [], [LIMITED]]


@pytest.mark.parametrize(("edge", "ticks", "tick_ns"), [item for item in VARIABLE_EDGES if item.values[1] in (4, 7)])
def test_a_variable_out_of_limits_counts_as_the_limit(edge, ticks, tick_ns):
    """0, a negative value or a 100th, and 100 times too much filter as the nearest limit does."""
    name = edge.parameter.lower()
    for side, bound, _ in edge.bounds(ticks * tick_ns / 1e9):
        expected, variables = edge.instance(ticks, tick_ns)
        at_limit = [expected.scan(input=value, **{name: bound}, **variables)["output"] for value in INPUTS]
        for value in (bound / 100, 0.0, -bound) if side == "low" else (bound * 100, 9.2e18):
            block, variables = edge.instance(ticks, tick_ns)
            assert [block.scan(input=item, **{name: value}, **variables)["output"] for item in INPUTS] == at_limit


@pytest.mark.parametrize(("edge", "ticks", "tick_ns"), [item for item in VARIABLE_EDGES if item.values[1] in (4, 7)])
def test_the_limits_are_worth_telling_apart(edge, ticks, tick_ns):
    """What the test above compares does depend on the parameter."""
    name = edge.parameter.lower()
    for _, bound, outward in edge.bounds(ticks * tick_ns / 1e9):
        results = []
        for value in (bound, bound * (1.5 if outward < 1 else 0.6)):
            block, variables = edge.instance(ticks, tick_ns)
            results.append([block.scan(input=item, **{name: value}, **variables)["output"] for item in INPUTS])
        assert results[0] != results[1]


@pytest.mark.parametrize("ticks", [1, 4, 10, 100])
@pytest.mark.parametrize(
    ("edge", "low", "high", "digits"),
    [
        (AUTOMAX_EDGES[0], 0.0013872, 253.866, (5e-8, 5e-4)),
        (AUTOMAX_EDGES[1], 0.00137573, 256.055, (5e-9, 5e-4)),
        (AUTOMAX_EDGES[3], 0.0013872, 253.866, (5e-8, 5e-4)),
        (AUTOMAX_EDGES[4], 0.00137573, 256.055, (5e-9, 5e-4)),
        (AUTOMAX_EDGES[7], 0.00137573, None, (5e-9, 0)),
    ],
    ids=str,
)
def test_the_numbers_that_the_manual_prints_for_ticks_of_5_5_ms(edge, low, high, digits, ticks):
    """To the last digit printed, in the message."""
    for value, printed, step in ((1e-9, low, digits[0]), (9e9, high, digits[1])):
        if printed is not None:
            (found,) = edge.problems(value, ticks, 5_500_000)
            close = [number * ticks for number in stated(found.message)]
            assert any(number == pytest.approx(printed, abs=1.01 * step, rel=5e-7) for number in close)


def test_another_tick_rate_moves_the_limits():
    """The formulas with T rule, not the constants per TICKS: 100 rad/s at TICKS = 4 of 5.5 ms and of 1 ms."""
    edge = AUTOMAX_EDGES[4]
    assert len(edge.problems(100.0, 4, 5_500_000)) == 1
    assert edge.problems(100.0, 4, 1_000_000) == []
    assert len(edge.problems(0.0003, 4, 5_500_000)) == 1
    assert len(edge.problems(0.0018, 4, 1_000_000)) == 1


PID = {"KP": "KI=1.0, LOOP_TIME=0.022", "KI": "KP=1.0, LOOP_TIME=0.022", "KD": "KP=1.0, KI=1.0, LOOP_TIME=0.022"}


@pytest.mark.parametrize("parameter", list(PID))
def test_a_gain_of_pid_below_0(parameter):
    edge = Edge("PID", parameter, None, None, PID[parameter])
    for good in (0.0, 5.4210108e-20, 9.2233717e18):
        assert edge.problems(good, 4, 5_500_000) == []
    for bad in (-1e-6, -1e-19, -9.2233717e18):
        (found,) = edge.problems(bad, 4, 5_500_000)
        assert found.code == "AMX4084"
        assert 0.0 in stated(found.message.partition("limit")[2])


def test_the_loop_time_of_pid():
    """From 0.01 s; the scan period itself may be shorter."""
    edge = Edge("PID", "LOOP_TIME", None, None, "KP=1.0, KI=1.0")
    assert edge.problems(0.01, 2, 5_000_000) == []
    assert edge.problems(0.0100001, 4, 5_500_000) == []
    assert edge.problems(9.2233717e18, 4, 5_500_000) == []
    for bad in (0.00999999, 0.0, -1.0):
        (found,) = edge.problems(bad, 4, 5_500_000)
        assert found.code in ("AMX4080", "AMX4084")
        assert 0.01 in stated(found.message)


def prop_int(parameters, declare="R"):
    """The findings of a PROP_INT at 22 ms; R is a variable, or a tunable."""
    return problems(
        f"10 LOCAL A%, B%, Q(2)\n15 LOCAL {declare}\n20 CALL SCAN_LOOP(TICKS=4)\n"
        f"30 CALL PROP_INT(INPUT=A%, {parameters}, OUTPUT=B%)\n40 END\n"
    )


LOWEST_WLD = TINY * mapping_constant(0.022)
"""That of KP = 1; a larger KP lowers it."""


@pytest.mark.parametrize("kp", ["R", "Q(1)"])
def test_a_constant_beside_a_variable_is_checked_as_loosely_as_the_variable_allows(kp):
    """KP goes to 128 at most, which makes WLD's low limit the least; the high one does not depend on it."""
    low, high = LOWEST_WLD / 128.0, 0.9 * PI / 0.022
    for good in (low * (1 + STEP), 1.0, high * (1 - STEP)):
        assert prop_int(f"KP={kp}, WLD={good:.7E}") == []
    for bad, side, bound in ((low * (1 - STEP), "low", low), (-5.0, "low", low), (1000000.0, "high", high)):
        (found,) = prop_int(f"KP={kp}, WLD={bad:.7E}")
        assert found.code == "AMX4084"
        assert f"{side} limit" in found.message
        assert "KP 0.001 to 128" in found.message
        assert any(number == pytest.approx(bound, rel=1e-6) for number in stated(found.message))


@pytest.mark.parametrize(
    ("low", "high", "kp"),
    [(0.5, 4.0, 4.0), (0.5, 1000.0, 128.0), (200.0, 300.0, 128.0), (-8.0, -2.0, 0.001)],
)
def test_a_tunable_moves_between_its_low_and_high(low, high, kp):
    """As far as KP's own limits let it: 0.001 to 128."""
    declare = f"R [CURRENT={high}, HIGH={high}, LOW={low}, STEP=0.1]"
    bound = LOWEST_WLD / kp
    assert prop_int(f"KP=R, WLD={bound * (1 + STEP):.7E}", declare) == []
    (found,) = prop_int(f"KP=R, WLD={bound * (1 - STEP):.7E}", declare)
    assert found.code == "AMX4084"


def test_a_bad_constant_causes_no_second_error():
    """With an impossible KP nobody knows WLD's low limit; the high one holds all the same."""
    (found,) = prop_int("KP=500.0, WLD=-5.0")
    assert "KP = 500" in found.message
    assert [item.message[:3] for item in prop_int("KP=500.0, WLD=1000000.0")] == ["KP ", "WLD"]


CROSSED = [
    pytest.param("INTEGRATE(INPUT=A%, KI=0.005, WM=0.02, OUTPUT=B%)", 30_000, "WM", 0.9 * PI / 300, 0.01, id="WM"),
    pytest.param("NOTCH(INPUT=A%, Q_FACTOR=2.0, WN=0.02, OUTPUT=B%)", 7_000, "WN", PI / 5 / 70, 0.01, id="WN"),
]


@pytest.mark.parametrize(("call", "ticks", "name", "high", "low"), CROSSED)
def test_limits_that_cross_at_long_scans_blame_ticks(call, ticks, name, high, low):
    def found(text):
        text = f"10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS={ticks})\n30 CALL {text}\n40 END\n"
        return problems(text, tick_ns=10_000_000)

    for bad in ("0.02", "0.005"):
        (item,) = found(call.replace(f"{name}=0.02", f"{name}={bad}"))
        assert item.code == "AMX4084"
        assert any(number == pytest.approx(high, rel=1e-6) for number in stated(item.message))
        assert low in stated(item.message)
        assert item.hint == f"at this scan period hardly any {name} is possible: TICKS is too large"
    assert found(call.replace(f"{name}=0.02", f"{name}={high:.9f}")) == []


@pytest.mark.parametrize(
    ("loop_time", "ticks", "tick_ns", "written", "every"),
    [
        (0.01, 1, 7_500_000, "0.015", "every 2nd scan"),
        (0.013, 1, 3_000_000, "0.012", "every 4th scan"),
        (0.01027, 1, 500_000, "0.0105", "every 21st scan"),
        (0.01, 1, 3_700_000, "0.0111", "every 3rd scan"),
        (0.025, 4, 5_500_000, "0.022", "every scan"),
        (0.0107, 1, 1_000_000, "0.011", "every 11th scan"),
    ],
)
def test_a_loop_time_that_is_suggested_is_possible(loop_time, ticks, tick_ns, written, every):
    """The nearest number of scans that is 0.01 s at least."""
    edge = Edge("PID", "LOOP_TIME", None, None, "KP=1.0, KI=1.0")
    (found,) = problems(edge.text(f"{loop_time}", ticks, tick_ns), tick_ns=tick_ns)
    assert found.code == "AMX4099"
    assert found.hint == f"write {written} if the block runs in {every}"
    assert problems(edge.text(written, ticks, tick_ns), tick_ns=tick_ns) == []
