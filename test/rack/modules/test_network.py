"""The 57C404: what racks on one network exchange, what is lost, what it shows (57C570 manual p. 18-4 to 18-7)."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from automax_ros.rack.modules.network import CYCLE_NS
from automax_ros.rack.modules.network_drops import MISSES, MOST_RIVALS, TIMEOUT_CYCLES, DropMessage, Reception, Sender
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.modules.network import greatest_depth, registers_of
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack
from rack.helpers import Observer, config_at
from rack.modules.network_racks import LINE, MASTER, SLAVE, WIND, Cable, built, station

LOST_AFTER = TIMEOUT_CYCLES * MISSES


@pytest.fixture
def line(tmp_path) -> Rack:
    return built(tmp_path / "line", MASTER, LINE)


@pytest.fixture
def wind(tmp_path) -> Rack:
    return built(tmp_path / "wind", SLAVE, WIND)


@pytest.fixture
def cable(line, wind) -> Cable:
    cable = Cable(line, wind).start()
    cable.cycles(4)
    return cable


def test_outputs_of_one_rack_are_inputs_of_the_other(cable, line, wind):
    line.write("SPEED%", -1234)
    cable.cycles(4)
    assert wind.value("REF%") == -1234
    assert line.value("FEEDBACK%") == -1234
    assert line.value("OK@") is True
    assert wind.value("LENGTH!") == -100_000
    assert wind.value("FOR_ALL%") == 11


def test_each_drop_has_its_registers_and_no_others(cable, line, wind):
    """What stands in a register of one rack stands in the same register of the other, and nowhere else."""
    line.operations.stop_tasks()
    wind.operations.stop_tasks()
    views = {rack: rack.backplane.bank(slot).view for rack, slot in ((line, 5), (wind, 8))}
    for number in range(32):
        line.write_view(views[line], [(64 * 3 + 32 + number, 100 + number), (64 * 4 + 32 + number, 200 + number)], 2)
        line.write_view(views[line], [(64 * 5 + 32 + number, 300 + number)], 2)
        wind.write_view(views[wind], [(64 * 3 + number, 400 + number), (64 * 4 + number, 500 + number)], 2)
    cable.cycles(2)

    def area(rack: Rack, drop: int) -> list[int]:
        return [rack.memory.read_now(views[rack], 64 * drop + number) for number in range(64)]

    for drop, up, down in ((3, 400, 100), (4, 500, 200)):
        both = [*range(up, up + 32), *range(down, down + 32)]
        assert area(line, drop) == area(wind, drop) == both
    assert area(wind, 5) == [0] * 64
    assert area(line, 5) == [0] * 32 + list(range(300, 332))


def test_the_status_of_a_slave_shows_its_drops_and_the_master(cable, wind):
    """Figure 18.2: of a slave at drop 2 with depth 3 register 4 is 0000000000011101; here it is 3 with depth 2."""
    assert wind.value("DROPS%") == 0b11001
    assert wind.value("OWN%") & 0xFFFF == 0x8003


def test_the_master_shows_drops_whose_depth_a_task_has_defined(tmp_path, line):
    silent = built(tmp_path / "wind", SLAVE, WIND.replace("110 DEPTH% = 2\n", "").replace(", DEPTH%", ""))
    cable = Cable(line, silent).start()
    line.write("SPEED%", 5)
    cable.cycles(6)
    assert silent.value("REF%") == line.value("FEEDBACK%") == 5, "a drop communicates before its depth is defined"
    assert not line.value("UP3@")
    assert silent.value("DROPS%") == 0
    silent.write("DEPTH%", 1)
    cable.cycles(3)
    assert line.value("UP3@")
    assert not line.value("UP4@")
    assert silent.value("DROPS%") == 0b1001


@pytest.mark.parametrize(
    ("written", "shown", "depth"),
    [(1, 0x8001, 1), (53, 0x8035, 53), (54, 0xC036, 2), (0x4001, 0x8001, 1), (0x3FFF, 0xFFFF, 2), (0, 0, 2)],
)
def test_a_depth_is_processed_or_the_last_good_one_is_kept(cable, wind, written, shown, depth):
    assert wind.value("DEPTH%") & 0xFFFF == 0x8002
    wind.operations.stop_tasks()
    wind.write("DEPTH%", written)
    cable.cycles(1)
    assert wind.value("DEPTH%") & 0xFFFF == shown
    assert station(wind).status().depth == depth


def test_greatest_depths_are_those_of_the_manual():
    assert (greatest_depth(54), greatest_depth(10)) == (2, 46)


def test_a_lost_slave_is_code_c_and_its_values_stay(cable, line, wind):
    line.write("SPEED%", 321)
    cable.cycles(4)
    assert station(line).status().code == ""
    before = line.value("TIMEOUTS%")
    cable.cut = {wind}
    cable.cycles(LOST_AFTER - 1)
    assert station(line).status().code == ""
    assert line.value("UP3@")
    cable.cycles(2)
    status = station(line).status()
    assert (status.code, status.lost) == ("C", (3, 4))
    assert not line.value("UP3@")
    assert line.value("FEEDBACK%") == 321
    assert line.stop_reason is None, "tasks go on"
    cable.cycles(100)
    assert line.value("TIMEOUTS%") - before == 2 * MISSES, "a lost drop is awaited no longer"
    assert station(wind).status().code == "C"
    assert wind.value("DROPS%") == 0
    cable.cut = set()
    cable.cycles(4)
    assert station(line).status().code == station(wind).status().code == ""
    assert line.value("UP3@")


def test_a_slave_without_a_master_is_silent_and_a_master_alone_is_not(cable, line, wind):
    cable.cut = {line, wind}
    cable.cycles(LOST_AFTER + 2)
    cable.carried.clear()
    cable.cycles(10)
    assert {rack for rack, _ in cable.carried} == {line}
    assert [frame.drop for _, frame in cable.carried] == [0, 3] * 10, "drop 3 has a variable, drop 4 is not heard"


def test_stop_all_lets_the_others_see_0(cable, line, wind):
    line.write("SPEED%", 900)
    cable.cycles(4)
    line.operations.stop_all("by hand")
    cable.cycles(2)
    assert wind.value("REF%") == 0
    assert wind.value("FOR_ALL%") == 0
    assert line.value("FEEDBACK%") == 0, "inputs keep updating"
    assert line.value("UP3@"), "and so does the status"
    wind.operations.stop_all("by hand")
    cable.cycles(LOST_AFTER)
    assert wind.value("DEPTH%") & 0xFFFF == 0x8002
    assert line.value("UP3@")


def test_without_power_it_is_silent_and_forgets(cable, line, wind):
    line.write("SPEED%", 900)
    cable.cycles(4)
    wind.operations.power_off()
    assert wind.value("REF%") == wind.value("OWN%") == wind.value("DEPTH%") == 0
    cable.cycles(LOST_AFTER + 1)
    assert wind.value("REF%") == 0
    assert station(line).status().code == "C"
    wind.operations.power_on()
    cable.cycles(3)
    assert wind.value("REF%") == 900
    assert wind.value("DROPS%") == 0, "its tasks rest: no depth is defined"
    wind.operations.run("WIND")
    cable.cycles(3)
    assert wind.value("DROPS%") == 0b11001


def test_counters(cable, wind):
    module = station(wind)
    before = dict(module.status().counters)
    cable.cycles(32)
    after = dict(module.status().counters)
    assert after["received"] - before["received"] == 2 * 32, "the broadcast registers and drop 3: nothing is at drop 4"
    assert after["transmitted"] - before["transmitted"] == 2 * 32
    assert after["timeouts"] == after["missed"] == after["unreadable"] == 0
    assert 0 < wind.value("RECEIVED%") <= after["received"]
    module.receive([], damaged=7)
    assert dict(module.status().counters)["unreadable"] == 7
    cable.racks[0].run(0.011)  # two cycles of the master alone: the slave hears both
    assert dict(module.status().counters)["missed"] == 0
    cable.cut = {wind}
    cable.cycles(3)
    cable.cut = set()
    cable.cycles(20)
    assert dict(module.status().counters)["missed"] == wind.value("MISSED%") == 3


def test_two_racks_with_one_drop_are_told_to_both(tmp_path, line, wind):
    other = built(tmp_path / "other", SLAVE.replace("rack: WIND", "rack: TWIN").replace("drop: 3", "drop: 4"), WIND)
    cable = Cable(line, wind, other).start()
    cable.cycles(8)
    assert [str(item) for item in station(wind).status().rivals] == ["rack TWIN slot 5"]
    assert [str(item) for item in station(other).status().rivals] == ["rack WIND slot 5"]
    assert [str(item) for item in station(line).status().rivals] == ["rack TWIN slot 5"], "the second that came"
    cable.cut = {other}
    cable.cycles(LOST_AFTER + 1)
    assert station(wind).status().rivals == station(line).status().rivals == ()


def test_two_masters_are_told_to_all(tmp_path, line, wind):
    second = built(tmp_path / "second", MASTER.replace("rack: LINE", "rack: LINE2"), LINE)
    cable = Cable(line, wind, second).start()
    line.write("SPEED%", 10)
    second.write("SPEED%", 20)
    cable.cycles(8)
    assert wind.value("REF%") == 10, "the one that it heard first"
    assert [item.rack for item in station(line).status().rivals] == ["LINE2"]
    assert [item.rack for item in station(second).status().rivals] == ["LINE"]
    assert [item.rack for item in station(wind).status().rivals] == ["LINE2"]


def sound(**fields: object) -> DropMessage:
    return replace(DropMessage(3, 2, True, 3, 1, tuple(range(32))), **fields)


@pytest.mark.parametrize(
    "frame",
    [
        sound(station=-1),
        sound(station=56, depth=1, drop=56),
        sound(depth=0),
        sound(depth=54),
        sound(drop=2),
        sound(drop=5),
        sound(words=(0,) * 31),
        sound(words=(0,) * 31 + (40_000,)),
        sound(station=0, depth=2, drop=0),
        sound(station=0, depth=1, drop=56),
    ],
)
def test_frames_that_no_station_sends_are_counted_and_dropped(cable, line, frame):
    assert not frame.is_sound
    before = line.memory.image()
    unreadable = dict(station(line).status().counters)["unreadable"]
    station(line).receive([(Sender(9, 9, "X"), frame)])
    assert line.memory.image() == before
    assert dict(station(line).status().counters)["unreadable"] == unreadable + 1


def test_what_arrives_is_written_by_the_module_at_that_instant(cable, line, wind):
    log: list = []

    class Watcher(Observer):
        def written(self, writes: list) -> None:
            log.extend(entry for group in writes for entry in group.entries())

    wind.observe(Watcher())
    line.write("SPEED%", 4321)
    cable.cycles(4)
    writer = next(item.id for item in wind.writers if item.name == "network_8")
    entries = [item for item in log if item.view == wind.memory.view("REF%")]
    assert [(item.writer, item.value) for item in entries] == [(writer, 4321)]
    assert entries[0].time_ns % CYCLE_NS == 0


def test_alone_a_rack_waits_in_vain_and_stimuli_write_its_inputs(tmp_path, wind):
    path = tmp_path / "stimuli.yaml"
    path.write_text("- {at: 0.2, set: {REF%: 700}}\n- {at: 0.3, set: {DROPS%: 9}}\n")
    stimuli = read_for_rack(path, wind).stimuli
    assert stimuli is not None
    played = StimuliPlayer(stimuli, wind.scheduler)
    wind.start()
    played.begin()
    wind.run(0.15)
    assert station(wind).status().code == "C"
    assert wind.value("FEEDBACK%") == wind.value("DROPS%") == 0
    wind.run(0.5)
    assert played.refused == 0
    assert wind.value("FEEDBACK%") == 700
    assert wind.value("DROPS%") == 9


@pytest.mark.parametrize("cycles", [1, 7, 40])
def test_a_state_goes_on_as_the_rack_would(tmp_path, cable, line, wind, cycles):
    cable.cycles(cycles)
    states = [rack.state() for rack in (line, wind)]
    for state in states:
        json.dumps(state.modules[5 if 5 in state.modules else 8])
    line.write("SPEED%", 42)
    again = [built(tmp_path / "l2", MASTER, LINE), built(tmp_path / "w2", SLAVE, WIND)]
    for rack, state in zip(again, states, strict=True):
        rack.load(state)
    second = Cable(*again)
    again[0].write("SPEED%", 42)
    cable.carried.clear()
    cable.cycles(30)
    second.cycles(30)
    assert [frame for _, frame in second.carried] == [frame for _, frame in cable.carried]
    for rack, other in zip((line, wind), again, strict=True):
        assert rack.memory.image() == other.memory.image()
        assert station(rack).status() == station(other).status()


def test_a_state_of_another_module_is_refused(wind):
    with pytest.raises(ValueError, match="network_8 has another state"):
        station(wind).load({})


def test_registers_by_role():
    master, slave = registers_of(0, 1), registers_of(3, 2)
    assert slave.direction(64 * 4 + 31) == "output"
    assert slave.direction(64 * 4 + 32) == "input"
    assert master.direction(64 * 4 + 31) == "input"
    assert master.direction(64 * 4 + 32) == "output"
    assert [register.direction(32) for register in (master, slave)] == ["output", "input"]
    assert 64 * 5 in slave.reserved
    assert 64 * 5 not in master.reserved
    assert len(master.outputs) == 55 * 32 + 8
    assert len(slave.outputs) == 2 * 32 + 1


def test_a_task_that_writes_the_wrong_half_is_an_error(tmp_path):
    (tmp_path / "LINE.BLK").write_text(LINE.replace("OUTPUT1=REF%", "OUTPUT1=FEEDBACK%").replace("REF%", "FEEDBACK%"))
    (tmp_path / "rack.yaml").write_text(MASTER)
    config = config_at(tmp_path / "rack.yaml")
    assert [item.code for item in check_tasks(config)[0].result.diagnostics] == ["AMX4017"]


def test_strangers_with_many_names_are_a_few_rivals(cable, line):
    for number in range(1000):
        station(line).receive(
            [(Sender(number, 1, f"R{number}"), sound()), (Sender(number, 2, "X"), sound(station=9, depth=1, drop=9))]
        )
    assert len(station(line).status().rivals) == MOST_RIVALS
    before = len(cable.carried)
    cable.cycles(1)
    sent = [frame.drop for rack, frame in cable.carried[before:] if rack is line]
    assert sent == [0, 3], "nobody makes the master send more"


def test_a_sequence_goes_on_at_0():
    hearing, sender = Reception(), Sender(1, 2, "A")
    last = (1 << 32) - 1
    assert hearing.take(sender, sound(sequence=last)) == 0
    assert hearing.take(sender, sound(sequence=0)) == 0
    assert hearing.take(sender, sound(sequence=3)) == 2
    assert hearing.take(sender, sound(sequence=3)) is None, "twice the same"
    assert hearing.take(sender, sound(sequence=1)) is None, "overtaken"
    assert not hearing.rivals
