"""`automax bridge`: the steady state, the motor's run, the plot, and what it refuses."""

import json
import subprocess
import sys
from itertools import pairwise
from math import cos, pi, radians, sqrt

import pytest

from automax_ros.drive.circuit.steady import BridgeCase, steady_state
from cli.support import columns_of

LINE = ("--v-ll", "460", "--freq", "60", "--ls", "60e-6", "--rs", "0.005")
CASE = (*LINE, "--r", "0.05", "--l", "2e-3")
MOTOR = ("--motor-k", "1.7", "--inertia", "6", "--friction", "0.5", "--load", "0", "--duration", "1.5")


def test_json_has_exactly_the_keys_and_the_librarys_numbers(automax):
    result = automax("bridge", *CASE, "--emf", "200", "--alpha", "60", "--json")
    assert (result.code, result.err) == (0, "")
    values = json.loads(result.out)
    assert list(values) == [
        "mean_current_a", "rms_current_a", "ripple_pp_a", "mean_voltage_v", "zero_current_us", "overlap_deg",
        "continuous",
    ]  # fmt: skip
    state = steady_state(BridgeCase(460.0, 60.0, 60e-6, 0.005, 0.05, 2e-3, 200.0, 60.0))
    assert values == {key: getattr(state, key) for key in values}
    # The textbook's mean current, which neglects ripple during overlap.
    ideal = 3 * sqrt(2) / pi * 460 * cos(radians(60))
    assert values["mean_current_a"] == pytest.approx((ideal - 200) / (0.05 + 0.01 + 6 * 60 * 60e-6), rel=0.03)
    assert values["continuous"] is True


def test_reverse_mirrors(automax):
    forward = json.loads(automax("bridge", *CASE, "--emf", "200", "--alpha", "60", "--json").out)
    reverse = json.loads(automax("bridge", *CASE, "--emf=-200", "--alpha", "60", "--reverse", "--json").out)
    assert reverse["mean_current_a"] == pytest.approx(-forward["mean_current_a"])
    assert reverse["mean_voltage_v"] == pytest.approx(-forward["mean_voltage_v"])
    assert reverse["ripple_pp_a"] == pytest.approx(forward["ripple_pp_a"])


def test_text_for_an_engineer(automax):
    result = automax("bridge", *CASE, "--emf", "400", "--alpha", "60")
    assert result.out == (
        "bridge 1, alpha 60 deg (delta 120), line 460 V 60 Hz, EMF 400 V\n"
        "  mean current         19.139 A      rms 25.176 A, ripple 41.473 A peak to peak\n"
        "  mean voltage        400.957 V      ideal bridge, continuous 310.609 V\n"
        "  conduction    discontinuous        no current for 846.6 of 2777.8 us\n"
    )
    assert "overlap 5.926 deg" in automax("bridge", *CASE, "--emf", "200", "--alpha", "60").out
    late = automax("bridge", *CASE, "--emf", "-6.05e2", "--alpha", "174")
    assert "us for the outgoing SCR to recover" in late.out


def test_no_current_is_an_honest_zero(automax):
    values = json.loads(automax("bridge", *CASE, "--emf", "700", "--alpha", "60", "--json").out)
    assert (values["mean_current_a"], values["rms_current_a"], values["ripple_pp_a"]) == (0.0, 0.0, 0.0)
    assert values["continuous"] is False
    assert values["mean_voltage_v"] == pytest.approx(700)
    assert "no current can flow" in automax("bridge", *CASE, "--emf", "700", "--alpha", "60").out


def test_motor_from_rest(automax):
    result = automax("bridge", *CASE, "--alpha", "60", *MOTOR, "--csv", "run.csv")
    assert (result.code, result.err) == (0, "")
    table = columns_of((automax.folder / "run.csv").read_text())
    assert list(table) == ["t_s", "armature_a", "armature_v", "speed_rad_s"]
    times = [float(cell) for cell in table["t_s"]]
    assert times == [n / 1000 for n in range(1501)]
    speed = [float(cell) for cell in table["speed_rad_s"]]
    current = [float(cell) for cell in table["armature_a"]]
    assert (speed[0], current[0]) == (0.0, 0.0)
    assert max(speed) == pytest.approx(310.6 / 1.7, rel=0.02)
    assert f"{speed[-1]:.3f} rad/s" in result.out
    # Momentum: J dw = k integral of i - friction, by the trapezoidal rule on the table itself.
    charge = sum((a + b) / 2 for a, b in pairwise(current)) / 1000
    drag = sum((a + b) / 2 for a, b in pairwise(speed)) / 1000
    assert 6 * speed[-1] == pytest.approx(1.7 * charge - 0.5 * drag, rel=0.01)


def test_motor_run_as_json_and_without_a_table(automax):
    result = automax("bridge", *CASE, "--emf", "200", "--alpha", "60", *MOTOR, "--json")
    last = json.loads(result.out)
    assert last["t_s"] == 1.5
    assert last["speed_rad_s"] > 100
    assert last["greatest_a"] > 1000
    assert "--emf is not used" in result.err


def test_a_motor_on_bridge_2_runs_backwards(automax):
    last = json.loads(automax("bridge", *CASE, "--alpha", "60", *MOTOR, "--reverse", "--json").out)
    assert last["speed_rad_s"] < -100


def test_plot_is_a_picture(automax):
    pytest.importorskip("matplotlib")
    result = automax("bridge", *CASE, "--emf", "400", "--alpha", "60", "--plot", "bridge.png")
    assert (result.code, result.err) == (0, "")
    picture = (automax.folder / "bridge.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 20_000
    wrong = automax("bridge", *CASE, "--alpha", "60", "--plot", "none/bridge.png")
    assert (wrong.code, wrong.out) == (2, "")
    assert "cannot be written" in wrong.err
    for name in ("bridge.nothing", "bridge"):
        assert automax("bridge", *CASE, "--alpha", "60", "--plot", name).code == 2
        assert not (automax.folder / name).exists()


def test_matplotlib_is_imported_only_to_plot():
    code = (
        "import sys; from automax_ros.cli.main import main; "
        "main(['bridge', '--r', '0.05', '--l', '2e-3', '--alpha', '60', '--json']); "
        "assert not {'matplotlib', 'numpy', 'scipy', 'rclpy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_plot_without_matplotlib_says_what_to_do(automax, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = automax("bridge", *CASE, "--alpha", "60", "--plot", "bridge.png")
    assert result.code == 2
    assert "--plot needs matplotlib" in result.err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--r", "0.05", "--l", "-1e-3", "--alpha", "60"), "armature inductance in H is -0.001, it must be 1e-09 to"),
        (("--r", "-1", "--l", "1e-3", "--alpha", "60"), "armature resistance in ohm is -1"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "190"), "alpha in degrees is 190, it must be 0 to 180"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "-5"), "alpha in degrees is -5"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "60", "--freq", "25"), "frequency in Hz is 25, it must be 48 to 62"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "60", "--v-ll", "0"), "line-to-line voltage in V is 0"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "60", "--ls", "-1e-6"), "source inductance in H is -1e-06"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "60", "--emf", "nan"), "argument --emf: 'nan' is not a number"),
        ((*CASE, "--alpha", "170", "--emf", "-640"), "SCRs fail to commutate"),
        ((*CASE, "--alpha", "60", "--inertia", "6"), "--inertia is for a motor's run"),
        ((*CASE, "--alpha", "60", "--motor-k", "1.7", "--duration", "1"), "a motor's run needs --inertia"),
        ((*CASE, "--alpha", "60", "--motor-k", "0", "--inertia", "6", "--duration", "1"), "motor constant k"),
        (("--r", "0.05", "--l", "1e-3", "--alpha", "60", "--v-ll", "1e308"), "line-to-line voltage in V is 1e+308"),
        ((*CASE, "--alpha", "60", "--motor-k", "1e200", "--inertia", "1e-200", "--duration", "1"), "motor constant k"),
        ((*CASE, "--alpha", "60", "--motor-k", "100", "--inertia", "1e-3", "--duration", "1"), "take a larger inertia"),
        ((*CASE, "--alpha", "60", "--motor-k", "1", "--inertia", "6", "--duration", "-1"), "duration in s is -1"),
        ((*CASE, "--alpha", "60", *MOTOR, "--csv", "no/run.csv"), "no/run.csv cannot be written"),
        ((*CASE, "--alpha", "60", *MOTOR, "--plot", "run.png"), "--plot is for a steady state"),
        ((*CASE, "--alpha", "sixty"), "'sixty' is not a number"),
    ],
)
def test_impossible_input_is_2_with_a_clear_message(automax, arguments, told):
    result = automax("bridge", *arguments)
    assert (result.code, result.out) == (2, "")
    assert told in result.err
    assert "Traceback" not in result.err
