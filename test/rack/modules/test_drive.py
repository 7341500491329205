"""The 57C406 in a rack: its interrupts, registers, switches and relays, and what becomes of its plant."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import pytest

from automax_ros.cli.run.status import StatusDisplay
from automax_ros.drive.current_loop.signals import (
    EXTERNAL_TRIP,
    LINE,
    PERMISSIVE,
    RESET_SWITCH,
    SWITCH_A,
    SWITCH_B,
    VOLTAGE,
    Command,
)
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.runtime.time.scheduler import EventClass, EventKey
from rack.helpers import run_for
from rack.modules.drive_racks import CYCLE_NS, YAML, Hand, built, controller, turning

SCAN = EventKey(EventClass.SCAN, 4, "CML")


def test_it_interrupts_six_times_a_line_cycle(tmp_path):
    rack = run_for(built(tmp_path))
    hand = Hand(rack).arm(5_500_000)
    rack.run(2.0)
    instants = [now for now, _, _ in hand.seen]
    assert instants[0] == 5_500_000
    steps = [after - before for before, after in itertools.pairwise(instants)]
    # Once it is locked to a steady line of 60 Hz, no interval is off by more than the smallest change of the PLL.
    assert all(abs(step - CYCLE_NS) < 2000 for step in steps[360:])
    assert sum(steps[-360:]) == pytest.approx(1e9, rel=1e-4)
    assert controller(rack).timing.interrupts == len(instants)
    assert controller(rack).timing.greatest_ns == controller(rack).timing.late == 0


def test_without_a_command_the_interval_stays(tmp_path):
    rack = run_for(built(tmp_path))
    seen: list[int] = []
    port = rack.drives.port(7)

    def due(now_ns: int, _: int) -> None:
        seen.append(now_ns)
        if len(seen) == 3:
            port.command(Command(2_000_000))

    port.arm(1_000_000, SCAN, due)
    rack.run(0.015)
    usual = 2_777_778
    begin = [1_000_000, 1_000_000 + usual, 1_000_000 + 2 * usual]
    assert seen == begin + [begin[-1] + 2_000_000 * n for n in range(1, 5)]
    assert port.next_ns == seen[-1] + 2_000_000
    port.disarm()
    assert port.next_ns is None
    rack.run(0.1)
    assert len(seen) == 7


def test_a_command_that_comes_late_moves_the_next_interrupt_to_the_present_at_the_earliest(tmp_path):
    rack = run_for(built(tmp_path))
    port, seen = rack.drives.port(7), []
    port.arm(1_000_000, SCAN, lambda now, _: seen.append(now))
    rack.run(0.002)
    port.command(Command(3_000_000))
    assert port.next_ns == 4_000_000
    port.command(Command(500_000))
    assert port.next_ns == rack.now_ns == 2_000_000


def test_scans_stand_in_their_place_among_those_of_an_instant(tmp_path):
    """Interrupts come before all scans of their instant, the scan that they make due by priority and name."""
    rack = run_for(built(tmp_path))
    order: list[str] = []
    for name, priority in (("A", 4), ("D", 4), ("Z", 3)):
        key = EventKey(EventClass.SCAN, priority, name)
        rack.scheduler.at(5_000_000, key, lambda _, name=name: order.append(name))
    rack.drives.port(7).arm(5_000_000, SCAN, lambda *_: order.append("CML"))
    rack.run(0.006)
    assert order == ["Z", "A", "CML", "D"]


def test_on_the_wall_clock_late_interrupts_are_carried_out_in_order_and_counted(tmp_path):
    rack = run_for(built(tmp_path))
    hand = Hand(rack).arm(0)
    rack.scheduler.run_due(2_900_000)
    rack.scheduler.run_due(20_000_000)
    instants = [now for now, _, _ in hand.seen]
    assert len(instants) == 8
    assert all(abs(now - n * CYCLE_NS) < 10_000 for n, now in enumerate(instants))
    timing = controller(rack).timing
    assert timing.interrupts == 8
    assert timing.greatest_ns == 20_000_000 - instants[2]
    late = [2_900_000 - now for now in instants[:2]] + [20_000_000 - now for now in instants[2:]]
    assert timing.late == sum(ns > 1_000_000 for ns in late) == 6
    assert timing.describe() == "8 interrupts, 6 later than 1 ms, the latest by 14.4 ms"


def test_the_summary_of_a_live_run_shows_it(tmp_path, capsys):
    rack = run_for(built(tmp_path))
    Hand(rack).arm(0)
    rack.scheduler.run_due(1_200_000)
    for live in (True, False):
        StatusDisplay(rack, (), live=live).finish()
        shown = "drive_7: 1 interrupt, 1 later than 1 ms, the latest by 1.2 ms" in capsys.readouterr().out
        assert shown is live


def test_initialisation_writes_the_defaults_and_later_writes_stay(tmp_path):
    rack = run_for(built(tmp_path))
    rack.write("TLD%", 77)
    hand = Hand(rack).arm(0)
    assert rack.value("TLD%") == 77
    rack.run(0.001)
    assert [rack.value(name) for name in ("TLD%", "PLLP%", "PLLT%", "FAST@")] == [109, 4, 2, False]
    for name, value in {"TLD%": 300, "PLLP%": -80, "PLLT%": 40, "FAST@": True}.items():
        rack.write(name, value)
    rack.run(0.5)
    measured = hand.seen[-1][1]
    found = measured.tach_threshold, measured.phase_step, measured.period_step, measured.options
    assert found == (300, -80, 40, 1)
    assert rack.value("TLD%") == 300
    rack.operations.stop_all("test")
    assert [rack.value(name) for name in ("TLD%", "PLLP%", "PLLT%", "FAST@")] == [0, 0, 0, False]


def test_tasks_reach_its_four_registers_and_no_other(tmp_path):
    task = """\
10 COMMON LAMP@
20 LOCAL READ%(6), N%
100 CALL SCAN_LOOP(TICKS=1)
110 IOWRITE 7, 4136, 55
120 IOWRITE 7, 4137, 8
130 IOWRITE 7, 4135, 9
140 FOR N% = 0 TO 5
150 READ%(N%) = IOREAD%(7, 4134 + N%)
160 NEXT N%
170 READ%(6) = IOREAD%(7, 4147)
180 END
"""
    rack = run_for(built(tmp_path, task=task), 0.005)
    assert rack.task("IDLE").value("READ%") == [0, 0, 55, 8, 0, 0, 0]
    assert rack.task("IDLE").errors.count == 2


@pytest.mark.parametrize(("name", "bit"), [("PERMIT@", PERMISSIVE), ("IET@", EXTERNAL_TRIP)])
def test_it_reads_the_inputs_of_the_drive_digital_module(tmp_path, name, bit):
    rack = run_for(built(tmp_path))
    hand = Hand(rack).arm(0)
    rack.run(0.01)
    assert hand.seen[-1][1].status == LINE | VOLTAGE
    rack.write(name, True)
    rack.run(0.01)
    assert hand.seen[-1][1].status == LINE | VOLTAGE | bit
    rack.force(name, False)
    rack.run(0.01)
    assert hand.seen[-1][1].status == LINE | VOLTAGE


def test_a_slot_without_a_digital_module_permits_nothing(tmp_path):
    rack = run_for(built(tmp_path))
    hand = Hand(rack, dig_io_slot=5).arm(0)
    rack.write("PERMIT@", True)
    rack.run(0.01)
    assert hand.seen[-1][1].status == LINE | VOLTAGE


def test_the_switches_on_its_front_are_seen_and_let_go(tmp_path):
    rack = run_for(built(tmp_path))
    hand = Hand(rack).arm(0)

    def status() -> int:
        rack.run(0.01)
        return hand.seen[-1][1].status & (SWITCH_A | SWITCH_B | RESET_SWITCH)

    controls = SwitchOperations(rack)
    assert status() == 0
    for position, bit in (("A", SWITCH_A), ("B", SWITCH_B), ("centre", 0)):
        controls.module("7", "test_switch", position)
        assert status() == bit
        rack.run(1.0)
        assert status() == bit
    began = rack.now_ns
    controls.module("7", "fault_reset_switch", "true")
    assert status() == RESET_SWITCH
    rack.run(1.0)
    pressed = [now for now, measured, _ in hand.seen if measured.status & RESET_SWITCH]
    assert pressed[0] - began < CYCLE_NS
    assert 0 < began + 500_000_000 - pressed[-1] <= CYCLE_NS + 1000
    controls.module("7", "fault_reset_switch", "true")
    rack.run(0.1)
    controls.module("7", "fault_reset_switch", "false")
    assert status() == 0


def test_relays_and_drive_ok_stand_in_the_digital_module_and_other_outputs_stay(tmp_path):
    rack = run_for(built(tmp_path))
    rack.write("LAMP@", True)
    port = rack.drives.port(7)
    wanted = iter(Command(2_777_778, relays=relays, ok=ok) for relays, ok in ((1, True), (2, False), (0, True)))
    port.arm(0, SCAN, lambda *_: (port.measure(8), port.command(next(wanted))))

    def outputs() -> list[object]:
        return [rack.value(name) for name in ("FMCR@", "RMCR@", "OK@", "LAMP@")]

    for expected in ([True, False, True, True], [False, True, False, True], [False, False, True, True]):
        rack.run(CYCLE_NS * 1e-9)
        assert outputs() == expected
    port.disarm()
    assert outputs() == [False, False, False, True]


def test_a_drive_turns_its_motor_and_stops_with_its_task(tmp_path):
    rack, hand = turning(tmp_path)
    plant = rack.plants["UNWIND"]
    assert rack.value("FMCR@") is True
    assert plant.motor.speed_rad_s > 20
    assert plant.bridge.wiring.armature_closed
    hand.port.disarm()
    assert (rack.value("FMCR@"), rack.value("OK@")) == (False, False)
    assert plant.bridge.pending == []
    assert plant.bridge.gated_numbers(rack.now_ns) == ()
    rack.run(0.05)
    assert not plant.bridge.wiring.armature_closed
    assert plant.circuit.current_a == 0
    speed = plant.motor.speed_rad_s
    assert plant.now_ns >= rack.now_ns - 5_500_000
    rack.run(1.0)
    assert 0 < plant.motor.speed_rad_s <= speed


@pytest.mark.parametrize("loss", ["stop_all", "power_off"])
def test_the_plant_goes_on_while_the_rack_does_not(tmp_path, loss):
    rack, hand = turning(tmp_path)
    count = len(hand.seen)
    if loss == "stop_all":
        rack.operations.stop_all("test")
    else:
        rack.operations.power_off()
    rack.run(0.5)
    plant = rack.plants["UNWIND"]
    assert len(hand.seen) == count
    assert plant.now_ns >= rack.now_ns - 5_500_000
    assert not plant.bridge.wiring.armature_closed
    assert plant.motor.speed_rad_s > 20
    if loss == "power_off":
        rack.operations.power_on()
        rack.run(0.5)
        assert plant.now_ns >= rack.now_ns - 5_500_000


def test_without_a_plant_there_is_no_line(tmp_path):
    rack = run_for(built(tmp_path, yaml=YAML.replace(", plant: UNWIND", "")))
    hand = Hand(rack).arm(0)
    rack.run(1.5)
    assert {measured.status for _, measured, _ in hand.seen} == {VOLTAGE}
    assert not hand.loop.outputs.sync_locked


@pytest.mark.parametrize("cut_s", [0.3, 0.6551, 0.7013, 1.2077])
@pytest.mark.parametrize("armed_first", [False, True])
def test_a_state_goes_on_bit_for_bit_wherever_it_is_cut(tmp_path, cut_s, armed_first):
    """Before the lock, while the contactor closes, at the first pulses, under current: through JSON."""
    rack = run_for(built(tmp_path))
    hand = Hand(rack, cml_run=False, reference=2000).arm(0)
    rack.write("PERMIT@", True)
    rack.run(min(cut_s, 0.6))
    hand.set(cml_run=True)
    SwitchOperations(rack).module("7", "fault_reset_switch", "true")
    SwitchOperations(rack).module("7", "test_switch", "B")
    rack.run(max(0.0, cut_s - 0.6))
    state = rack.state()
    kept = {slot: json.loads(json.dumps(state.modules[slot])) for slot in (7, 8, 9)}
    plants = json.loads(json.dumps(state.plants))
    other = built(tmp_path)
    other.load(replace(state, modules={**state.modules, **kept}, plants=plants))
    new = Hand(other)
    new.inputs = hand.inputs
    new.loop.take(hand.loop.numbers())
    new.arm(hand.port.next_ns)
    if armed_first:  # as by a Processor in a slot below
        controller(other).load(kept[7])
    before = len(hand.seen)
    for one in (rack, other):
        one.run(0.7)
    assert hand.seen[before:] == new.seen
    assert rack.plants.state() == other.plants.state()
    assert rack.state().image == other.state().image
    if cut_s > 1:
        assert rack.plants["UNWIND"].motor.speed_rad_s > 20
    hand.port.disarm()
    new.port.disarm()
    for one in (rack, other):
        one.run(0.1)
    assert rack.plants.state() == other.plants.state()


def test_a_plant_at_rest_is_looked_at_after_a_state_was_loaded(tmp_path):
    rack = run_for(built(tmp_path), 0.0123)
    other = built(tmp_path)
    other.load(rack.state())
    for one in (rack, other):
        one.run(0.0101)
    assert rack.plants["UNWIND"].now_ns == other.plants["UNWIND"].now_ns == 22_000_000
