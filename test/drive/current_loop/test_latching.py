"""When inputs are read and what bad ones do (52.1), on a drive that turns: three clocks, last good values, ranges."""

from dataclasses import replace

import pytest

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.plant.plant import DrivePlant, PlantData
from drive.current_loop.protected import LOCKED_S, Drive

TICK_NS = 5_500_000
STANDBY, RUN, TEST = "standby", "run", "test"
EVERY = {STANDBY, RUN, TEST}


def drive_in(state, **changes):
    """A drive that is in standby, runs, or runs in test mode, just after a scan with a tick."""
    drive = Drive(cml_test=state == TEST, **changes)
    if state == STANDBY:
        drive.run(LOCKED_S)
    else:
        drive.start()
    until_a_tick(drive)
    return drive


def until_a_tick(drive):
    rows = len(drive.rows)
    while len(drive.rows) == rows:
        drive.scan()


def scans_until_read(drive, name, value):
    """Change an input and return at which scan it is in force: 1 is the next; None within 20."""
    drive.inputs = drive.inputs._replace(**{name: value})
    for scan in range(1, 21):
        drive.scan()
        if getattr(drive.loop.latched, name) == value:
            return scan
    return None


@pytest.mark.parametrize("state", sorted(EVERY))
@pytest.mark.parametrize(
    ("name", "value", "read_in"),
    [
        ("cml_run", None, EVERY),
        ("cc_thresh", 99, EVERY),
        ("cml_coast_stop", True, {RUN, TEST}),
        ("ref_rate", 2.5, {RUN, TEST}),
        ("kp", 0.75, {RUN, TEST}),
        ("test_alpha", 150, {TEST}),
        ("cml_test", None, {STANDBY}),
        ("test_brpol", True, {STANDBY}),
        ("fault_reset", True, {STANDBY}),
    ],
)
def test_a_dynamic_input_is_read_at_the_next_tick_of_its_state(state, name, value, read_in):
    drive = drive_in(state)
    value = not getattr(drive.inputs, name) if value is None else value
    # A tick is 1.98 scans long: after one with a tick comes one without.
    assert scans_until_read(drive, name, value) == (2 if state in read_in else None)


@pytest.mark.parametrize("state", sorted(EVERY))
def test_the_reference_is_read_at_each_scan(state):
    assert scans_until_read(drive_in(state), "reference", 1234) == 1


@pytest.mark.parametrize("state", sorted(EVERY))
@pytest.mark.parametrize(("options", "fast", "both"), [(1, True, False), (2, False, True), (3, True, True)])
def test_register_4146_is_read_in_standby(state, options, fast, both):
    drive = drive_in(state)
    drive.registers = (109, 4, 2, options)
    drive.run(0.02)
    latched = drive.loop.latched
    assert (latched.fast_change, latched.both_bridges) == ((fast, both) if state == STANDBY else (False, False))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ref_lag", 100.0), ("pi_w_lead", 77.0), ("ag_factor", 9), ("max_m_dropout", 0.5), ("ioc_thresh", 200),
        ("lim_bar", 180), ("osv_thresh", 12), ("auto_phrot", True), ("tach_loss_stop", False), ("digital_tach", False),
    ],
)  # fmt: skip
def test_a_fixed_input_is_read_once(name, value):
    drive = Drive()
    drive.scan()
    before = getattr(drive.loop.latched, name)
    assert scans_until_read(drive, name, value) is None
    assert getattr(drive.loop.latched, name) == before != value
    drive.loop.restart()
    assert scans_until_read(drive, name, value) == 1


def test_what_is_read_in_run_counts_from_the_first_scan_of_the_run():
    drive = Drive(kp=0.0).start()
    drive.run(0.05, cml_run=False)
    drive.run(0.05, kp=0.5, ref_rate=2.0)
    assert drive.loop.latched.kp == 0.0
    drive.inputs = drive.inputs._replace(cml_run=True)
    while not drive.loop.sequence.running:
        drive.scan()
    assert (drive.loop.latched.kp, drive.loop.latched.ref_rate) == (0.5, 2.0)


DYNAMIC = [
    ("kp", [0.0, 4.0], [-0.001, 4.001, float("nan")], 0.0),
    ("cc_thresh", [0, 32767], [-1, -32768], 0),
    ("test_alpha", [120, 180], [-1, 181], 180),
    ("ref_rate", [0.0, 0.00035, 11.37], [-1.0, 0.0003, 11.4], 0.0),
]


@pytest.mark.parametrize(("name", "good", "bad", "first"), DYNAMIC)
def test_a_bad_dynamic_value_leaves_the_last_good_one_and_is_logged_as_it_goes_bad(name, good, bad, first):
    drive = Drive(cml_test=True, **{name: bad[0]}).start()
    assert getattr(drive.loop.latched, name) == first
    assert drive.codes == ["AMX7105"]
    for value in good:
        drive.run(0.02, **{name: value})
        assert getattr(drive.loop.latched, name) == value
    assert drive.codes == ["AMX7105"]
    for value in bad:
        drive.run(0.1, **{name: value})
        assert getattr(drive.loop.latched, name) == good[-1]
    assert drive.codes == ["AMX7105"] * 2
    drive.run(0.02, **{name: good[0]})
    drive.run(0.1, **{name: bad[0]})
    assert drive.codes == ["AMX7105"] * 3
    assert drive["DC_CML_STATE"]


def test_each_bad_dynamic_value_is_logged_for_itself():
    drive = Drive(kp=9.0, ref_rate=-1.0, cc_thresh=-1).start()
    assert drive.codes == ["AMX7105"] * 3


@pytest.mark.parametrize(("hertz", "low", "high"), [(60, 0.00035, 11.37), (50, 0.00042, 13.65)])
def test_the_limits_of_ref_rate_follow_the_line(hertz, low, high):
    plant = DrivePlant(PlantData(derive(replace(EXAMPLES["150hp"], line_hz=hertz)), inertia=1000.0))
    drive = Drive(plant=plant, ac_line_freq=hertz).start()
    for value in (low, high):
        drive.run(0.02, ref_rate=value)
        assert (drive.loop.latched.ref_rate, drive.codes) == (value, [])
    for value in (low - 0.00001, high + 0.01):
        drive.run(0.02, ref_rate=value)
        drive.run(0.02, ref_rate=1.0)
    assert drive.codes == ["AMX7105"] * 2


FIXED = {
    "ref_lag": (0.9, 501.0), "pi_w_lead": (9.9, 501.0), "ag_factor": (0, 301), "max_m_dropout": (0.09, 1.01),
    "ioc_thresh": (99, 401), "lim_bar": (99, 401), "osv_thresh": (-1,),
}  # fmt: skip


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, bad in FIXED.items() for value in bad])
def test_a_bad_fixed_value_is_logged_and_the_drive_never_runs(name, value):
    drive = Drive(**{name: value})
    drive.run(LOCKED_S)
    assert drive.log == [(0, "AMX7106")]
    drive.run(0.5, cml_run=True)
    good = Drive().inputs
    drive.run(0.02, cml_run=False, **{name: getattr(good, name)})
    drive.run(0.5, cml_run=True)
    assert (drive["SYNC_LOCKED"], drive["DC_CML_STATE"], drive.relay) == (True, False, False)
    assert drive.codes == ["AMX7106"]
    drive.loop.restart()
    drive.start()


def test_each_bad_fixed_value_is_logged():
    drive = Drive(ag_factor=0, pi_w_lead=0.0, lim_bar=0)
    drive.run(0.1)
    assert drive.codes == ["AMX7106"] * 3


@pytest.mark.parametrize(("hertz", "highest"), [(60, 500.0), (50, 400.0)])
def test_ref_lag_may_be_less_on_a_line_of_50_hz(hertz, highest):
    for value, codes in ((highest, []), (highest + 1.0, ["AMX7106"])):
        drive = Drive(ac_line_freq=hertz, ref_lag=value)
        drive.scan()
        assert drive.codes == codes


@pytest.mark.parametrize(
    ("lim_bar", "ioc", "codes"),
    [
        (100, 179, []),
        (100, 180, ["AMX7107"]),
        (150, 269, []),
        (150, 270, ["AMX7107"]),
        (222, 400, ["AMX7107"]),
        (223, 400, []),
    ],
)
def test_the_ioc_level_must_be_less_than_1_8_lim_bar(lim_bar, ioc, codes):
    drive = Drive(lim_bar=lim_bar, ioc_thresh=ioc)
    drive.run(LOCKED_S)
    drive.run(0.3, cml_run=True)
    assert drive.codes == codes
    assert drive["DC_CML_STATE"] == (not codes)


LOOP = ("DC_TIME", "BRIDGE_POL", "REF_RATE_OUT", "REF_LAG_OUT", "FDBK_GAIN", "I_FDBK", "INTEGRAL_GAIN", "DELTA")


@pytest.mark.parametrize("state", sorted(EVERY))
def test_registers_of_another_ratio_are_told_once_and_used_as_they_are(state):
    """52.5.1: 4137 must be twice 4138."""
    drive = drive_in(state)
    drive.registers = (109, 80, 40, 0)
    drive.run(0.1)
    assert drive.codes == []
    for phase_step in (80, 20, 80):
        drive.registers = (109, phase_step, 30, 0)
        drive.run(0.1)
        assert drive.codes == ["AMX7117"]
    assert drive.loop.pll.locked
    assert drive["DC_CML_STATE"] is (state != STANDBY)


def test_a_ratio_that_is_wrong_between_two_writes_is_not_told():
    drive = drive_in(RUN)
    for registers in ((109, 80, 2, 0), (109, 80, 40, 0)) * 3:
        drive.registers = registers
        until_a_tick(drive)
    assert drive.codes == []


def test_outputs_are_written_at_the_first_scan_of_each_tick():
    drive = Drive()
    drive.run(1.0)
    ticks = [instant // TICK_NS for instant, _ in drive.rows]
    assert ticks == list(range(len(ticks)))
    assert all(instant % TICK_NS <= 2_777_778 for instant, _ in drive.rows)


def test_loop_outputs_are_0_at_first_and_held_in_standby():
    drive = Drive(reference=1500)
    drive.run(LOCKED_S)
    assert all(row[name] == 0 for _, row in drive.rows for name in LOOP)
    drive.start()
    drive.run(0.3)
    assert abs(drive["I_FDBK"] - 1500) < 400
    drive.run(0.2, cml_run=False)
    held = [drive[name] for name in LOOP]
    assert not drive["DC_CML_STATE"]
    assert held[LOOP.index("FDBK_GAIN")] > 0
    drive.run(0.5, reference=-3000)
    assert [drive[name] for name in LOOP] == held
    drive.loop.restart()
    drive.run(0.02)
    assert [drive[name] for name in LOOP] == [0] * len(LOOP)
