"""A switched circuit integrated by scipy: what the model is judged by. It shares no code with it.

Line, closed SCRs and armature are branches of a graph. Each set of closed SCRs gives independent loops (the null
space of the incidence matrix), ``B' L B y' = B' (v - R B y)``, which ``solve_ivp`` integrates with a fine step;
events stop it where the current of an SCR or the forward voltage over a gated one crosses zero. SCRs are ideal,
recovery takes no time.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

# SCR: where its current comes from and where it goes.
WAYS = {
    1: ("a", "P"), 3: ("b", "P"), 5: ("c", "P"), 4: ("M", "a"), 6: ("M", "b"), 2: ("M", "c"),
    14: ("P", "a"), 16: ("P", "b"), 12: ("P", "c"), 11: ("a", "M"), 13: ("b", "M"), 15: ("c", "M"),
}  # fmt: skip
NODES = ["n", "a", "b", "c", "P", "M"]
LATER = {"a": 0.0, "b": 2 * np.pi / 3, "c": -2 * np.pi / 3}
FORWARD_V = 1e-6


@dataclass
class Segment:
    """Times, loop currents as branch currents (by name), the SCRs that conducted."""

    time: np.ndarray
    current: np.ndarray
    phases: np.ndarray
    on: frozenset


@dataclass
class Switched:
    v_ll: float
    ls: float
    rs: float
    r: float
    l: float  # noqa: E741
    emf: float = 0.0
    motor: tuple = ()  # k, inertia, friction, load torque; the EMF is then k speed
    speed: float = 0.0
    angle: object = None  # line angle (rad) as a function of time; phase a is its cosine
    shorted: tuple = ()
    lost: frozenset = frozenset()
    arcs: dict = field(default_factory=dict)  # phase: voltage of its opening arc, with the sign of its current
    step: float = 20e-6
    rtol: float = 1e-9
    gates: list = field(default_factory=list)  # (from s, to s, SCR)
    time: float = 0.0
    on: frozenset = frozenset()
    currents: dict = field(default_factory=lambda: {"a": 0.0, "b": 0.0, "c": 0.0, "d": 0.0})
    segments: list = field(default_factory=list)
    charge: float = 0.0
    square: float = 0.0

    def __post_init__(self):
        if self.angle is None:
            self.angle = lambda t: 2 * np.pi * 60 * t

    def source(self, phase, time):
        return np.sqrt(2 / 3) * self.v_ll * np.cos(self.angle(time) - LATER[phase])

    def branches(self, on):
        """(name, from, to, L, R) of every branch; the current counts from -> to."""
        rows = [(x, "n", x, self.ls, self.rs) for x in "abc" if x not in self.lost]
        rows.append(("d", "P", "M", self.l, self.r))
        rows += [(scr, *WAYS[scr], 0.0, 0.0) for scr in sorted(on)]
        rows += [(("short", scr), *WAYS[scr], 0.0, 0.0) for scr in self.shorted if scr not in on]
        return rows

    def loops(self, on):
        rows = self.branches(on)
        incidence = np.zeros((len(NODES), len(rows)))
        for column, (_, start, end, _, _) in enumerate(rows):
            incidence[NODES.index(start), column] -= 1
            incidence[NODES.index(end), column] += 1
        basis = null_space(incidence)
        inductance = np.diag([row[3] for row in rows])
        resistance = np.diag([row[4] for row in rows])
        return rows, basis, np.linalg.pinv(basis.T @ inductance @ basis), basis.T @ resistance @ basis

    def drive(self, rows, time, emf):
        volts = {"d": -emf}
        volts |= {x: self.source(x, time) - self.arcs.get(x, 0.0) for x in "abc"}
        return np.array([volts.get(name, 0.0) for name, *_ in rows])

    def gated(self, time):
        return {scr for start, end, scr in self.gates if start <= time < end}

    def forward(self, on, rows, basis, y, rate, time, emf):
        """The forward voltage over each SCR that is off, for single ones and pairs that would close a loop."""
        names = [row[0] for row in rows]
        i, di = dict(zip(names, basis @ y, strict=True)), dict(zip(names, basis @ rate, strict=True))
        level = {
            x: self.source(x, time) - self.arcs.get(x, 0.0) - self.rs * i[x] - self.ls * di[x]
            for x in "abc" if x not in self.lost
        }  # fmt: skip
        closed = [WAYS[scr] for scr in (*on, *self.shorted)]
        armature = emf + self.r * i["d"] + self.l * di["d"]
        for _ in range(3):
            for one, two in closed:
                for known, other in ((one, two), (two, one)):
                    if known in level:
                        level.setdefault(other, level[known])
            if "P" in level:
                level.setdefault("M", level["P"] - armature)
            if "M" in level:
                level.setdefault("P", level["M"] + armature)
        volts = {}
        off = [scr for scr in self.watched if scr not in on]
        for scr in off:
            start, end = WAYS[scr]
            if start in level and end in level:
                volts[scr,] = level[start] - level[end]
        if "P" not in level:
            for one in off:
                for two in off:
                    start, middle = WAYS[one]
                    other, end = WAYS[two]
                    if (
                        start in level
                        and end in level
                        and {middle, other} <= {"P", "M"}
                        and (start, middle) != (end, other)
                    ):
                        drop = 0.0 if middle == other else emf if middle == "P" else -emf
                        volts[one, two] = level[start] - level[end] - drop
        return volts

    def run(self, until):
        edges = sorted({edge for start, end, _ in self.gates for edge in (start, end) if self.time < edge < until})
        for start, end in pairwise([self.time, *edges, until]):
            self.time = start
            self.watched = sorted(self.gated(start))
            for _ in range(1000):
                if self.time >= end - 1e-13:
                    break
                self.interval(end)
            else:
                raise RuntimeError(f"stuck at {self.time} with {sorted(self.on)}")

    def interval(self, end):
        on = self.on
        rows, basis, inverse, resistance = self.loops(on)
        names = [row[0] for row in rows]
        width = basis.shape[1]
        start = np.zeros(len(rows))
        # Loop currents that keep the currents of the inductive branches.
        held = [n for n, name in enumerate(names) if name in ("a", "b", "c", "d")]
        start[held] = [self.currents[names[n]] for n in held]
        y0 = np.linalg.lstsq(basis[held], start[held], rcond=None)[0]

        def emf(state):
            return self.motor[0] * state[-1] if self.motor else self.emf

        def rate(time, state):
            return inverse @ (basis.T @ self.drive(rows, time, emf(state)) - resistance @ state[:width])

        def full(time, state):
            d = basis[names.index("d")] @ state[:width]
            turn = 0.0
            if self.motor:
                k, inertia, friction, load = self.motor
                turn = (k * d - friction * state[-1] - load) / inertia
            return np.concatenate([rate(time, state), [d, d * d, turn]])

        y0 = np.concatenate([y0, [0.0, 0.0, self.speed]])

        # Who turns on at once?
        volts = self.forward(on, rows, basis, y0[:width], rate(self.time, y0), self.time, emf(y0))
        ready = {who: v for who, v in volts.items() if v > FORWARD_V}
        if ready:
            self.on = on | set(max(ready, key=ready.get))
            return
        # Who goes out at once?
        di, i = basis @ rate(self.time, y0), basis @ y0[:width]
        leaving = {
            s for s in on
            if i[names.index(s)] < -1e-6 or (i[names.index(s)] < 1e-6 and di[names.index(s)] < -1e-3)
            or np.abs(basis[names.index(s)]).max(initial=0.0) < 1e-9  # no way round
        }  # fmt: skip
        if leaving:
            self.on = on - leaving
            return
        events, actions = [], []
        for scr in sorted(on):
            column = basis[names.index(scr)]
            event = self.ending(column, self.time)
            event.terminal, event.direction = True, -1
            events.append(event)
            actions.append(on - {scr})
        for who in volts:
            event = self.crossing(who, lambda t, s: self.forward(on, rows, basis, s[:width], rate(t, s), t, emf(s)))
            event.terminal, event.direction = True, 1
            events.append(event)
            actions.append(on | set(who))
        for phase, volts_arc in self.arcs.items():
            column = np.sign(volts_arc) * basis[names.index(phase)]
            event = self.ending(column, self.time)
            event.terminal, event.direction = True, -1
            events.append(event)
            actions.append(phase)
        solution = solve_ivp(
            full, (self.time, end), y0, "DOP853", events=events, max_step=self.step,
            rtol=self.rtol, atol=1e-8, dense_output=False,
        )  # fmt: skip
        branch = basis @ solution.y[:width]
        phases = np.array([branch[names.index(x)] if x in names else np.zeros(branch.shape[1]) for x in "abc"])
        self.segments.append(Segment(solution.t, branch[names.index("d")], phases, on))
        self.time = solution.t[-1]
        self.charge += solution.y[width, -1]
        self.square += solution.y[width + 1, -1]
        self.speed = solution.y[width + 2, -1]
        final = basis @ solution.y[:width, -1]
        self.currents = {x: final[names.index(x)] if x in names else 0.0 for x in "abcd"}
        if solution.status == 1:
            hit = next(n for n, times in enumerate(solution.t_events) if len(times))
            if actions[hit] in self.arcs:
                self.open(actions[hit])
            else:
                self.on = actions[hit]
            if hit < len(on) or not isinstance(actions[hit], frozenset):  # SCRs in series go out together
                change = basis @ rate(self.time, solution.y[:, -1])
                row = names.index
                self.on = frozenset(s for s in self.on if abs(final[row(s)]) > 1e-6 or change[row(s)] > 0)
        self.on = frozenset(self.on)
        for phase in list(self.arcs):
            if abs(self.currents[phase]) < 1e-6:
                self.open(phase)

    @staticmethod
    def ending(column, start):
        """An event: a sum of loop currents falls to zero, but not one that only begins there."""
        return lambda t, s: column @ s[: len(column)] + (1e-9 if t - start < 1e-8 else 0.0)

    @staticmethod
    def crossing(who, volts):
        """An event: the forward voltage of SCRs exceeds zero."""
        return lambda t, s: volts(t, s)[who] - FORWARD_V

    def open(self, phase):
        self.arcs.pop(phase)
        self.lost |= {phase}

    def lose(self, phase, arc_v):
        if abs(self.currents[phase]) < 1e-6:
            self.lost |= {phase}
        else:
            self.arcs[phase] = arc_v * np.sign(self.currents[phase])

    def at(self, times):
        """The armature current at instants."""
        time = np.concatenate([segment.time for segment in self.segments])
        current = np.concatenate([segment.current for segment in self.segments])
        return np.interp(times, time, current)
