"""The tools that take one task or a folder of tasks, on the task of a drive."""

import json

import pytest
import yaml

DRIVE = """\
10 COMMON REF%, SPEED%, RUN@, RESET@, FB%
20 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, AC_LINE_FREQ=50, REFERENCE=REF%, KP=0.3, PI_W_LEAD=50.0, &
      CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, SPEED_FDBK=SPEED%, OSV_FDBK=SPEED%, FAULT_RESET=RESET@, I_FDBK=FB%)
30 END
"""


@pytest.fixture
def drive(automax):
    automax.write("CML.BLK", DRIVE)
    automax.write("IN.csv", "REF%\n100\n")
    return automax


def test_check_has_nothing_to_say(drive):
    assert drive("check", "CML.BLK") == (0, "", "")
    found = drive("check", "CML.BLK", "--tick-ms", "2")
    assert found.code == 1
    assert "error[AMX4181]: DC_DRIVE_CML needs a Processor with the tick of 5.5 ms" in found.out
    (item,) = json.loads(drive("check", "CML.BLK", "--target", "pc3000", "--json").out)
    assert (item["code"], item["line"], item["column"]) == ("AMX4071", 2, 9)


def test_compile_prints_the_call_of_the_loop(drive):
    result = drive("compile", "CML.BLK")
    assert (result.code, result.err) == (0, "")
    assert result.out.count("io.minor_loop((7, 8, 50, REF_i, 0.0, 200.0, 0.30000001192092896, 50.0, 1, 0, RUN_b, ") == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ("trace", "CML.BLK", "--input", "IN.csv"),
        ("response", "CML.BLK", "--block", "20"),
        ("tune-info", "CML.BLK"),
        ("tune-info", "CML.BLK", "--ki", "100", "5"),
    ],
)
def test_tools_that_count_scan_periods_refuse_it(drive, arguments):
    result = drive(*arguments)
    assert (result.code, result.out) == (2, "")
    assert (
        "CML.BLK runs a drive's DC_DRIVE_CML: the interrupts of a 57C406 begin its scans, not the clock" in result.err
    )
    assert "automax run CONFIG --simulated" in result.err


def drafted(automax, **tasks):
    for name, text in tasks.items():
        automax.write(f"plant/{name}.BLK", text)
    result = automax("new", "plant")
    text = (automax.folder / "plant" / "rack.yaml").read_text()
    return result, text, yaml.safe_load(text)


@pytest.fixture
def plant(automax):
    (automax.folder / "plant").mkdir()
    return automax


def test_new_drafts_the_modules_of_a_drive(plant):
    result, text, rack = drafted(plant, CML=DRIVE)
    assert (result.code, result.err) == (0, "")
    assert rack["slots"][7] == {"module": "57C406"}
    assert rack["slots"][8] == {"module": "57C408"}
    assert "# a scan every 3.33333 ms" in text
    assert "57C406 has a plant: docs/rack_yaml.md" in text
    assert plant("check", "plant").code == 0
    assert plant("run", "plant", "--simulated", "--duration", "0.1").code == 0


def test_new_names_a_slot_that_two_want(plant):
    result, text, rack = drafted(
        plant, A=DRIVE.replace("IO_CNTL_SLOT=7", "IO_CNTL_SLOT=1"), B=DRIVE.replace("=8,", "=7,")
    )
    assert rack["slots"][1]["module"] == "57C435"
    assert rack["slots"][7] == {"module": "57C406"}
    assert "# A wants a 57C406 in slot 1: choose another" in text
    assert "# B wants a 57C408 in slot 7: choose another" in text
    assert result.code == 1
    assert "error[AMX6486]: IO_CNTL_SLOT must name a 57C406; slot 1 holds the 57C435" in result.err


def test_new_without_a_drive_says_nothing_of_plants(plant):
    _, text, _ = drafted(plant, LINE="10 COMMON REF%\n20 CALL SCAN_LOOP(TICKS=4)\n30 END\n")
    assert "57C406" not in text


def test_load_takes_the_line_as_its_clock(plant):
    drafted(plant, CML=DRIVE)
    (module,) = json.loads(plant("load", "plant", "--json").out)
    (task,) = module["tasks"]
    latch, end = 80.0 + 5 * 1.6 + 3 * 2.5 + 2 * 3.8, 13.82 + 5 * 2.0 + 3 * 1.6 + 2 * 2.2
    assert task["scan_us"] == {"least": pytest.approx(latch + 250 + end), "most": pytest.approx(latch + 250 + end)}
    assert task["period_us"] == pytest.approx(1e6 / 300, abs=0.001)
    assert task["load_percent"] == pytest.approx((latch + 250 + end) / (1e6 / 300) * 100, abs=0.01)
    assert task["estimated"]


def test_bag_info_tells_its_period(plant):
    drafted(plant, CML=DRIVE)
    assert plant("run", "plant", "--simulated", "--duration", "0.1", "--record", "bag").code == 0
    (task,) = json.loads(plant("bag", "info", "bag", "--json").out)["tasks"]
    assert (task["ticks"], task["period_s"]) == (None, pytest.approx(1 / 300, abs=1e-9))
