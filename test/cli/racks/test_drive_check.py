"""`automax drive-check`: the manual's numbers of drives in racks, where they come from, and its exit codes."""

import json
from math import pi
from pathlib import Path

import pytest

from automax_ros.drive.assess.limits import boundary_amps
from automax_ros.drive.base.motor import Motor
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from cli.drive_racks import loop_task, rack_file, write_rack

ROOT = Path(__file__).parents[3]


@pytest.fixture
def judged(automax):
    """Judge a rack with one drive: its findings by rule, the exit code apart."""

    def judge(rack=None, *options, task=None, code=0, **tasks):
        write_rack(automax.folder, rack or rack_file(), LOOP=task or loop_task(), **tasks)
        result = automax("drive-check", "rack.yaml", "--json", *options)
        assert result.code == code, result
        (drive, *_) = json.loads(result.out)
        return {item["rule"]: item for item in drive["findings"]}

    return judge


def test_a_sound_drive_is_fine_and_every_formula_is_printed_with_its_numbers(automax):
    write_rack(automax.folder, rack_file(), LOOP=loop_task())
    result = automax("drive-check", "rack.yaml")
    assert (result.code, result.err) == (0, "")
    for text in (
        "UNWIND: 57C406 in slot 7", "task LOOP", "500 V, 245.8 A, 1750 rpm",
        "180 - ARCOS[(0.75 x 500) / (1.35 x 460)] = 127.1 deg",
        "(35 lb ft2 x 1750 rpm) / (308 x 708.7 lb ft) = 0.280 s",
        "2346.575 mH A / 245.8 A = 9.545 mH at 460 V",
        "225 < 1.8 x 150 = 270",
    ):  # fmt: skip
        assert text in result.out
    assert "attention   IOC" not in result.out
    assert "wrong" not in result.out


def test_the_page_shows_what_is_printed(automax):
    """docs/drive_tools.md: each line of its example is one of the output."""
    page = (ROOT / "docs" / "drive_tools.md").read_text(encoding="utf-8")
    example = page.partition("$ automax drive-check rack.yaml\n")[2].partition("\n```")[0].splitlines()
    write_rack(automax.folder, rack_file().replace("LOOP", "CML"), CML=loop_task())
    printed = automax("drive-check", "rack.yaml").out.splitlines()
    assert len(example) == 7
    assert [line for line in example if line != "  ..." and line not in printed] == []


@pytest.mark.parametrize(
    ("motor", "bound", "largest"),
    [("dc_150hp_500v", 127.1, 9.545), ("dc_10hp_240v", 125.4, 35.0), ("dc_800hp_700v", 126.1, 3.88)],
)
def test_bounds_of_the_example_motors(judged, motor, bound, largest):
    found = judged(rack_file(f"motor: {motor}"))
    assert round(found["tach loss threshold"]["values"]["delta_bound_deg"], 1) == bound
    assert found["fast bridge change"]["values"]["largest_inductance_mh"] == pytest.approx(largest, rel=2e-3)
    assert found["fast bridge change"]["verdict"] == "fine"


@pytest.mark.parametrize(("inertia", "verdict"), [(1, "attention"), (1.12, "attention"), (1.15, "fine"), (10, "fine")])
def test_jbar_of_the_10_hp_motor_needs_some_more_inertia(judged, inertia, verdict):
    """T is the torque of the armature, 1.205 N m an ampere, which is 7 % more than the plate's at the shaft."""
    found = judged(rack_file(f"motor: dc_10hp_240v, inertia: {inertia}"))["JBAR"]
    pounds = 1.2048 * 36.14 * 1.5 / 1.3558
    assert found["values"]["torque_n_m"] == pytest.approx(pounds * 1.3558, rel=1e-3)
    assert found["values"]["jbar_s"] == pytest.approx(1.5 * inertia * 1750 / (308 * pounds), abs=2e-3)
    assert found["verdict"] == verdict
    assert "of this plant's armature at LIM_BAR, JBAR is rounded down" in found["result"]
    assert ("leave register 4136 at 109" in found["result"]) == (verdict == "attention")


def threshold(automax, judged, statement, plant="motor: dc_150hp_500v", code=0):
    """The finding of a rack whose BASIC task writes register 4136 by a statement."""
    rack = rack_file(
        plant, more="  TLD%: {slot: 7, register: 4136}\n", tasks=", B_INIT: {priority: 9, file: B_INIT.BAS}"
    )
    task = f"10 COMMON TLD%, REF%\n20 {statement}\n30 END\n"
    return judged(rack, code=code, B_INIT=task)["tach loss threshold"]


@pytest.mark.parametrize(
    ("statement", "used", "verdict", "code"),
    [
        ("TLD% = 120", 120, "fine", 0), ("IOWRITE 7, 4136, 127", 127, "fine", 0), ("TLD% = 128", 128, "wrong", 1),
        ("TLD% = REF%", None, "attention", 0), ("REF% = 0", 109, "fine", 0), ("IOWRITE 7, 4137, 80", 109, "fine", 0),
    ],
)  # fmt: skip
def test_register_4136_is_what_a_basic_task_writes(automax, judged, statement, used, verdict, code):
    found = threshold(automax, judged, statement, code=code)
    assert (found["values"]["register_4136"], found["verdict"]) == (used, verdict)


def test_a_raised_threshold_needs_its_jbar(automax, judged):
    found = threshold(automax, judged, "TLD% = 110", "motor: dc_10hp_240v", code=1)
    assert found["verdict"] == "wrong"
    assert "only with a JBAR of 0.2 s" in found["result"]


def test_jbar_is_no_longer_than_the_plant_takes_to_base_speed(judged, tmp_path):
    """The least time in which LIM_BAR brings the unloaded shaft from rest to base speed, by the plant itself."""
    found = judged(rack_file("motor: dc_150hp_500v"))["JBAR"]["values"]["jbar_s"]
    motor = Motor(derive(EXAMPLES["150hp"]).motor)
    took_s = 0.0
    while motor.speed_rad_s < 1750 * pi / 30:
        motor.advance(1e-3, 1.5 * 245.83 * 1e-3, 0.0)
        took_s += 1e-3
    assert 0.95 * took_s < found <= took_s


@pytest.mark.parametrize(
    ("statements", "values", "verdict", "code"),
    [
        (("REF% = 0",), (4, 2), "fine", 0), (("IOWRITE 7, 4137, 80", "IOWRITE 7, 4138, 40"), (80, 40), "fine", 0),
        (("IOWRITE 7, 4137, 80",), (80, 2), "attention", 0), (("IOWRITE 7, 4138, 0",), (4, 0), "wrong", 1),
        (("IOWRITE 7, 4138, REF%",), (4, None), "attention", 0),
    ],
)  # fmt: skip
def test_4137_is_twice_4138(judged, statements, values, verdict, code):
    rack = rack_file(tasks=", B_INIT: {priority: 9, file: B_INIT.BAS}")
    body = "".join(f"{number} {text}\n" for number, text in enumerate(statements, 20))
    found = judged(rack, code=code, B_INIT=f"10 COMMON REF%\n{body}90 END\n")["line synchronization"]
    assert (found["values"]["register_4137"], found["values"]["register_4138"]) == values
    assert found["verdict"] == verdict
    assert ("used as they are" in found["result"]) == (verdict == "attention" and None not in values)


@pytest.mark.parametrize(
    ("level", "lim_bar", "verdict", "code"),
    [
        ("225", "150", "fine", 0), ("269", "150", "fine", 0), ("163", "150", "fine", 0), ("162", "150", "attention", 0),
        ("LEVEL%", "150", "attention", 0),
    ],
)  # fmt: skip
def test_overcurrent_lies_between_the_peaks_and_1_8_lim_bar(judged, level, lim_bar, verdict, code):
    """150 hp: the ripple's peak is (sqrt(2) 460 V / (377/s x 2.5 mH)) x (1 - sin 60) - 61.4 A = 31 A = 12.7 %."""
    found = judged(task=loop_task(IOC_THRESH=level, LIM_BAR=lim_bar), code=code)["IOC_THRESH"]
    assert found["verdict"] == verdict


def test_variables_count_as_what_the_one_assignment_gives_them(judged):
    found = judged(task=loop_task("LEVEL% = 275", IOC_THRESH="LEVEL%"), code=1)["IOC_THRESH"]
    assert found["values"]["ioc_thresh"] == 275
    assert found["verdict"] == "wrong"
    assert "LEVEL% = 275 (assigned)" in found["result"]
    twice = judged(task=loop_task("LEVEL% = 275", "LEVEL% = 200", IOC_THRESH="LEVEL%"))["IOC_THRESH"]
    assert twice["values"].get("ioc_thresh") is None
    assert twice["verdict"] == "attention"


@pytest.mark.parametrize(("level", "verdict", "code"), [(269, "fine", 0), (270, "wrong", 1), (400, "wrong", 1)])
def test_1_8_lim_bar_itself_is_too_much(judged, level, verdict, code):
    found = judged(task=loop_task(f"LEVEL% = {level}", IOC_THRESH="LEVEL%"), code=code)
    assert found["IOC_THRESH"]["verdict"] == verdict


def test_set_and_presets_are_values_of_commons(judged):
    task = loop_task(LIM_BAR="SPD%", SPEED_FDBK=None)
    assert "SPD% (not known)" in judged(task=task)["JBAR"]["result"]
    preset = rack_file().replace("SPD%: {}", "SPD%: {preset: 200}")
    assert judged(preset, task=task)["IOC_THRESH"]["values"]["lim_bar"] == 200
    assert judged(preset, "--set", "SPD%=140", task=task)["IOC_THRESH"]["values"]["lim_bar"] == 140


@pytest.mark.parametrize(
    ("hertz", "given", "verdict", "code"),
    [(60, None, "fine", 0), (50, "50", "fine", 0), (50, None, "wrong", 1), (60, "58", "attention", 0)],
)
def test_line_frequency(judged, hertz, given, verdict, code):
    rack = rack_file(f"motor: dc_150hp_500v, line: {{hz: {hertz}}}")
    assert judged(rack, task=loop_task(AC_LINE_FREQ=given), code=code)["AC_LINE_FREQ"]["verdict"] == verdict


def test_nothing_is_fine_of_a_frequency_that_no_task_gives(judged):
    task = "10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=2)\n30 A% = 1\n40 END\n"
    found = judged(task=task)["AC_LINE_FREQ"]
    assert (found["verdict"], found["values"]["ac_line_freq"]) == ("attention", None)
    assert "not known Hz" not in found["result"]


@pytest.mark.parametrize(
    ("statement", "wired", "millihenry", "verdict", "code"),
    [
        ("OPT% = 1", True, 2.22, "fine", 0), ("OPT% = 1", False, 2.22, "wrong", 1), ("OPT% = 1", True, 9.6, "wrong", 1),
        ("OPT% = BIT_SET%(OPT%, 0)", True, 9.6, "wrong", 1), ("OPT% = BIT_SET%(OPT%, 1)", False, 9.6, "fine", 0),
        ("OPT% = 2", False, 9.6, "fine", 0), ("OPT% = REF%", True, 9.6, "attention", 0),
        ("FAST@ = TRUE", False, 2.22, "wrong", 1), ("REF% = 1", False, 9.6, "fine", 0),
    ],
)  # fmt: skip
def test_fast_bridge_change_needs_table_3_and_the_armature_voltage(judged, statement, wired, millihenry, verdict, code):
    plate = f"{{hp: 150, volts: 500, rpm: 1750, amps: 245.8, inductance_h: {millihenry / 1000}}}"
    rack = rack_file(
        f"motor: {plate}",
        more="  OPT%: {slot: 7, register: 4146}\n  FAST@: {slot: 7, register: 4146, bit: 0}\n",
        slots="  9: {module: 57C405, drive: 7}\n" if wired else "",
        tasks=", B_INIT: {priority: 9, file: B_INIT.BAS}",
    )
    task = f"10 COMMON OPT%, FAST@, REF%\n20 {statement}\n30 END\n"
    assert judged(rack, code=code, B_INIT=task)["fast bridge change"]["verdict"] == verdict


def test_a_drive_of_a_udc_trips_75_points_above_its_overload_ratio(automax):
    rack = "rack: U\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435}\n  5: {module: 57552, plants: {A: W, B: V}}\n"
    rack += "plants:\n  W: {motor: dc_10hp_240v, motor_overload_ratio: 150}\n  V: {motor: dc_10hp_240v}\n"
    automax.write("rack.yaml", rack)
    first, second = json.loads(automax("drive-check", ".", "--json").out)
    (trip,) = first["findings"]
    assert (first["drive"], first["where"], first["task"]) == ("W", "57552 in slot 5, drive A", None)
    assert trip["values"]["trip"] == 225
    assert trip["verdict"] == "fine"
    assert second["verdict"] == "attention"


def test_a_drive_without_a_plant_is_named_with_the_reason(automax):
    write_rack(automax.folder, rack_file().replace(", plant: UNWIND", ""), LOOP=loop_task())
    result = automax("drive-check", "rack.yaml")
    assert result.code == 0
    assert "LOOP: 57C406 in slot 7" in result.out
    assert "attention   plant: without a plant" in result.out


def test_a_rack_without_a_drive_is_refused(automax):
    automax.write("rack.yaml", "rack: D\nslots: {0: {module: 57C435}}\n")
    result = automax("drive-check", "rack.yaml")
    assert (result.code, result.out) == (2, "")
    assert "the rack has no drive" in result.err
    assert "hint: a drive is a 57C406" in result.err


def test_a_task_with_errors_is_printed_and_the_rest_judged(automax):
    write_rack(automax.folder, rack_file(), LOOP=loop_task(KP=None))
    result = automax("drive-check", "rack.yaml")
    assert result.code == 1
    assert "KP" in result.err
    assert "LIM_BAR is not known" in result.out


@pytest.mark.parametrize("options", [["none.yaml"], ["rack.yaml", "--set", "NONE%=1"], ["rack.yaml", "--set", "REF%"]])
def test_wrong_use(automax, options):
    write_rack(automax.folder, rack_file(), LOOP=loop_task())
    result = automax("drive-check", *options)
    assert result.code == 2
    assert result.err.startswith("automax drive-check: error: ")


# hp, A, ohm and H with source, line V: the example motors of the nameplate's own test, LIM_BAR 150
CIRCUITS = {
    "dc_150hp_500v": (245.8, 0.0915 + 0.01 + 360 * 0.14e-3, 2.22e-3 + 0.28e-3, 460),
    "dc_10hp_240v": (36.1, 0.531 + 0.01 + 360 * 0.478e-3, 7.25e-3 + 0.956e-3, 230),
    "dc_800hp_700v": (906.6, 0.0216 + 0.01 + 360 * 0.0683e-3, 0.534e-3 + 0.1366e-3, 660),
}


@pytest.mark.parametrize("motor", CIRCUITS)
def test_gains_are_proposed_for_the_motor(judged, motor):
    amps, ohm, henry, volts = CIRCUITS[motor]
    found = judged(rack_file(f"motor: {motor}"))
    counts = 4095 / (1.5 * amps)
    proposed = {rule: item["values"]["proposed"] for rule, item in found.items() if "proposed" in item["values"]}
    assert list(proposed) == ["KP", "PI_W_LEAD", "REF_LAG", "CC_THRESH", "AG_FACTOR"]
    # a microsecond of DELTA at alpha 90 degrees raises the mean voltage by Vd0 w 1e-6 for one scan of 1 / (6 f)
    step = 1.3505 * volts * 2 * pi * 60 * 1e-6 / 360 / henry * counts
    assert proposed["KP"] == pytest.approx(0.65 / step, rel=0.01)
    assert proposed["PI_W_LEAD"] == pytest.approx(ohm / henry, abs=1)
    assert proposed["CC_THRESH"] == pytest.approx(boundary_amps(volts, 60, henry) * counts, rel=0.01)
    assert 10 <= proposed["REF_LAG"] <= 400
    assert 1 < proposed["AG_FACTOR"] <= 300
    told = {rule: float(found[rule]["result"].split()[0]) for rule in proposed}
    assert told == pytest.approx(proposed, rel=1e-3)


@pytest.mark.parametrize(("execution", "model"), [("ideal", "57C435"), ("modeled", "57C435"), ("modeled", "57C430A")])
def test_the_gains_are_reckoned_with_the_delay_of_the_slowest_processor(automax, execution, model):
    """Table 4: SCAN_LOOP and the estimate of the block; of all Processors a 57C430A takes longest."""
    rack = rack_file().replace("slots:", f"execution: {execution}\nslots:").replace("57C435", model)
    write_rack(automax.folder, rack, LOOP=loop_task())
    (drive,) = json.loads(automax("drive-check", "rack.yaml", "--json").out)
    assert (drive["execution"], drive["model"]) == (execution, model)
    found = {item["rule"]: item for item in drive["findings"]}
    values = found["computing delay"]["values"]
    assert values["sixth_us"] == pytest.approx(2777.8, abs=0.1)
    assert 1400 < values["reckoned_us"] < 1500
    if (execution, model) == ("modeled", "57C435"):
        assert 350 < values["delay_us"] < 420
    else:
        assert values["delay_us"] == (0 if execution == "ideal" else values["reckoned_us"])
    assert f"{execution} execution on a {model}: DELTA takes effect " in found["computing delay"]["result"]
    assert "the slowest Processor that may run this task" in found["computing delay"]["result"]
    assert found["KP"]["values"]["proposed"] == 0.224609375  # the same for all
    assert f"task LOOP on a {model}, {execution} execution" in automax("drive-check", "rack.yaml").out


@pytest.mark.parametrize(
    ("execution", "model", "verdict"),
    [("ideal", "57C430A", "fine"), ("modeled", "57C435", "fine"), ("modeled", "57C430A", "attention")],
)
def test_a_scan_that_takes_longer_than_the_gains_bear_is_told(judged, execution, model, verdict):
    names = [f"X{number}%" for number in range(90)]
    lines = [f"COMMON {', '.join(names[place : place + 9])}" for place in range(0, 90, 9)]
    rack = rack_file(more="".join(f"  {name}: {{}}\n" for name in names))
    rack = rack.replace("slots:", f"execution: {execution}\nslots:").replace("57C435", model)
    found = judged(rack, task=loop_task(*lines))["computing delay"]
    assert found["verdict"] == verdict
    assert ("declare fewer commons" in found["result"]) == (verdict == "attention")
    assert ("too slow for a 57C430A" in found["result"]) == (verdict == "fine")


def test_no_delay_is_known_of_a_drive_without_a_task(judged):
    found = judged(task="10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=2)\n30 A% = 1\n40 END\n")["computing delay"]
    assert (found["verdict"], found["values"]) == ("attention", {})


@pytest.mark.parametrize(
    ("text", "verdict", "source"),
    [
        ("0.2246", "fine", "0.2246"), ("0.44", "fine", "0.44"), ("0.12", "fine", "0.12"), ("0.5", "attention", "0.5"),
        ("0.1", "attention", "0.1"), ("KP", "attention", "KP = 0.5 (tunable)"),
    ],
)  # fmt: skip
def test_a_gain_is_fine_within_a_factor_of_two(judged, text, verdict, source):
    found = judged(task=loop_task(KP=text))["KP"]
    assert found["verdict"] == verdict
    assert found["result"].endswith(f"programmed: {source}")


def test_defaults_of_gains_are_told_as_such(judged):
    found = judged()
    assert found["CC_THRESH"]["result"].endswith("programmed: 0 (default)")
    assert (found["CC_THRESH"]["verdict"], found["AG_FACTOR"]["verdict"]) == ("attention", "attention")


def test_without_lim_bar_there_is_no_proposal(judged):
    found = judged(task=loop_task(LIM_BAR="LEVEL%"))["KP"]
    assert found["values"] == {}
    assert "no proposal, LIM_BAR is LEVEL% (not known)" in found["result"]
