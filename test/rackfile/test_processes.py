"""Which modules of a distributed rack share a process: what acts on another at an instant, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest
from config.examples import CONFIG, loaded
from hypothesis import given
from hypothesis import strategies as st
from rack.drives.drive_tasks import CML, folder_of
from rack.helpers import config_at

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.processes import MEMORY_PROCESS, NoSuchProcess, _groups, process_named, processes_of

IDLE = "10 CALL SCAN_LOOP(TICKS=2)\n20 END\n"
SETS = "10 EVENT NAME=GO\n20 SET GO\n30 STOP\n40 END\n"
WAITS = "10 EVENT NAME=GO\n20 WAIT ON GO\n30 STOP\n40 END\n"
READER = "10 LOCAL A%\n20 OPEN CHANNEL FOR INPUT AS FILE #9, TYPE = (I), DEPTH = 3\n30 INPUT #9, A%\n40 STOP\n50 END\n"
WRITER = "10 LOCAL A%\n20 OPEN CHANNEL FOR OUTPUT AS FILE #9, TYPE = (I)\n30 PRINT #9, A%\n40 STOP\n50 END\n"
HEARS = "10 COMMON ISCR%\n20 EVENT NAME=IO_INT, INTERRUPT_STATUS=ISCR%, TIMEOUT=9\n30 CALL SCAN_LOOP(TICKS=1)\n40 END\n"


def config_of(folder: Path, slots: str, more: str = "", **sources: str) -> RackConfig:
    """Return a rack with common memory in slot 0; a source that begins with OPEN or SET is a BASIC task."""
    for name, text in sources.items():
        kind = "BLK" if "SCAN_LOOP" in text or "DC_DRIVE_CML" in text else "BAS"
        (folder / f"{name}.{kind}").write_text(text)
    path = folder / "rack.yaml"
    path.write_text(f"rack: PM1\nslots:\n  0: {{module: 57C413}}\n{slots}{more}")
    return config_at(path)


def slots_of(config: RackConfig) -> list[tuple[int, ...]]:
    return [process.slots for process in processes_of(config)]


def processors(**tasks: str) -> str:
    """Return slots 1, 2 ...: a Processor for each task, given as NAME="file"."""
    lines = (
        f"  {slot}: {{module: 57C435, tasks: {{{name}: {{priority: 5, file: {file}}}}}}}\n"
        for slot, (name, file) in enumerate(tasks.items(), 1)
    )
    return "".join(lines)


def test_modules_that_meet_at_registers_alone_are_a_process_each(tmp_path):
    slots = processors(ONE="ONE.BLK", TWO="TWO.BLK") + "  5: {module: 57C419}\n  10: {module: 57552}\n"
    common = "common:\n  START@: {slot: 5, register: 0, bit: 0, ros: in}\n  SUM%: {}\n"
    config = config_of(tmp_path, slots, common, ONE="5 COMMON SUM%, START@\n" + IDLE, TWO="5 COMMON SUM%\n" + IDLE)
    processes = processes_of(config)
    names = [MEMORY_PROCESS, "processor_1", "processor_2", "digital_io_5", "udc_10"]
    assert [process.name for process in processes] == names
    assert [process.holds_common_memory for process in processes] == [True, False, False, False, False]
    assert all(process.reasons == () and len(process.slots) == 1 for process in processes)


def test_lone_processor_holds_common_memory(tmp_path):
    config = config_at(folder_of(tmp_path))
    (process,) = processes_of(config)
    assert (process.name, process.slots, process.holds_common_memory) == (MEMORY_PROCESS, (0, 7, 8), True)
    assert process.modules == ("processor_0", "drive_7", "digital_io_8")


def test_a_loop_keeps_its_drive_its_contactor_and_its_voltage(tmp_path):
    slots = processors(ONE="ONE.BLK", CML="CML.BLK") + (
        "  7: {module: 57C406, plant: UNWIND}\n  8: {module: 57C408}\n  9: {module: 57C405, drive: 7}\n"
        "  11: {module: 57C408}\n"
    )
    more = (
        "plants:\n  UNWIND: {motor: dc_150hp_500v}\ncommon: {REF%: {}, RUN@: {}, RESET@: {}, SPEED%: {}, OSV%: {}, "
        "STATE@: {}, LOCKED@: {}, PERIOD%: {}, CURRENT%: {}, DELTA%: {}, TACH@: {}, 'DIAG%(37,1)': {}}\n"
    )
    config = config_of(tmp_path, slots, more, ONE=IDLE, CML=CML)
    assert slots_of(config) == [(0,), (1,), (2, 7, 8, 9), (11,)]
    process = processes_of(config)[2]
    assert process.words == "processor_2 (processor_2 drive_7 digital_io_8 drive_analog_9)"
    assert process.reasons == (
        "task CML fires the gates of drive_7",
        "task CML reads the permissive of digital_io_8",
        "drive_analog_9 has the armature voltage of drive_7",
    )


def test_an_interrupt_keeps_its_module_with_the_processor_that_waits_for_it(tmp_path):
    slots = processors(ONE="ONE.BLK", TWO="TWO.BLK") + "  5: {module: 57C419}\n  6: {module: 57C419}\n"
    config = config_of(tmp_path, slots, "common:\n  ISCR%: {slot: 6, register: 2}\n", ONE=IDLE, TWO=HEARS)
    assert slots_of(config) == [(0,), (1,), (2, 6), (5,)]
    assert processes_of(config)[2].reasons == ("task TWO waits for the interrupt IO_INT of digital_io_6",)


def test_the_web_line_keeps_its_winder_with_the_udc_that_interrupts():
    config = loaded(CONFIG / "web_line")
    assert slots_of(config) == [(0,), (1,), (2,), (3, 10), (5,), (6,), (7,), (8,)]


@pytest.mark.parametrize(
    ("first", "second", "shared"),
    [(SETS, WAITS, "the event GO"), (WAITS, WAITS, "the event GO"), (WRITER, READER, "channel 9")],
)
def test_tasks_that_meet_at_an_event_or_a_channel_share_a_process(tmp_path, first, second, shared):
    kinds = ["BLK" if "SCAN_LOOP" in text else "BAS" for text in (first, second)]
    slots = processors(ONE=f"ONE.{kinds[0]}", TWO="TWO.BLK", THREE=f"THREE.{kinds[1]}")
    config = config_of(tmp_path, slots, ONE=first, TWO=IDLE, THREE=second)
    assert slots_of(config) == [(0,), (1, 3), (2,)]
    assert processes_of(config)[1].reasons == (f"tasks ONE and THREE share {shared}",)


def test_coupled_shafts_share_a_process(tmp_path):
    slots = processors(ONE="ONE.BLK") + (
        "  7: {module: 57C406, plant: REEL}\n  9: {module: 57C406, plant: ALONE}\n"
        "  10: {module: 57552, plants: {A: DRUM}}\n"
    )
    motor = "motor: dc_150hp_500v"
    plants = f"plants:\n  REEL: {{{motor}, couple: {{to: DRUM}}}}\n  DRUM: {{{motor}}}\n  ALONE: {{{motor}}}\n"
    config = config_of(tmp_path, slots, plants, ONE=IDLE)
    assert slots_of(config) == [(0,), (1,), (7, 10), (9,)]
    assert processes_of(config)[2].reasons == ("the shafts of REEL and DRUM are coupled",)


def test_a_task_with_errors_joins_nothing(tmp_path):
    slots = processors(ONE="ONE.BAS", TWO="TWO.BAS")
    config = config_of(tmp_path, slots, ONE=SETS, TWO=WAITS.replace("STOP", "STOPS"))
    assert slots_of(config) == [(0,), (1,), (2,)]


def test_a_reload_that_would_join_processes_is_refused(tmp_path):
    slots = processors(ONE="ONE.BAS", TWO="TWO.BAS")
    config = config_of(tmp_path, slots, ONE=SETS, TWO=WAITS.replace("GO", "ON_ITS_OWN"))
    whole, part = Rack(config).operations.installation, Rack(config, local={2}).operations.installation
    waits = SourceText("TWO.BAS", WAITS)
    assert whole.prepare("TWO", waits).fault is None
    fault = part.prepare("TWO", waits).fault
    assert str(fault) == (
        "TWO.BAS: tasks ONE and TWO share the event GO, so processor_1 and processor_2 would have to share a process: "
        "restart the rack with it; task TWO stays as it is"
    )
    assert part.prepare("TWO", SourceText("TWO.BAS", WAITS.replace("GO", "OTHER"))).fault is None


@pytest.mark.parametrize("text", ["3", "processor_3", " PROCESSOR_3 ", "10", "udc_10"])
def test_a_seat_is_named_by_slot_or_module(text):
    config = loaded(CONFIG / "web_line")
    assert process_named(processes_of(config), text).name == "processor_3"


@pytest.mark.parametrize(("text", "hint"), [("4", None), ("procesor_3", "did you mean processor_3?")])
def test_a_module_that_is_not_there_is_refused(text, hint):
    config = loaded(CONFIG / "web_line")
    with pytest.raises(NoSuchProcess) as told:
        process_named(processes_of(config), text)
    assert f"no module '{text}'" in told.value.message
    assert hint is None or told.value.hint == hint


@given(st.lists(st.lists(st.integers(0, 15), min_size=1, max_size=3), max_size=20))
def test_groups_are_what_can_be_reached_over_bonds(bonds):
    """Against an independent model: the connected components by search."""
    groups = _groups(range(16), [tuple(bond) for bond in bonds])
    assert sorted(slot for group in groups for slot in group) == list(range(16))
    for group in groups:
        reached, open_ends = {group[0]}, [group[0]]
        while open_ends:
            slot = open_ends.pop()
            for bond in bonds:
                if slot in bond:
                    open_ends += set(bond) - reached
                    reached |= set(bond)
        assert reached == set(group)
