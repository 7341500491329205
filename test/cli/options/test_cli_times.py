"""`--from` and `--to` mean the same in every command that reads recordings."""

import pytest
from recordings.independent import GOLDEN

COMMANDS = {
    "export": ["export", GOLDEN, "-o", "out.csv"],
    "plot": ["plot", GOLDEN, "SPEED_FDBK%", "-o", "out.png"],
    "replay": ["replay", GOLDEN],
    "play": ["play", "none"],
}
TIMES = {
    "1_0": "--from: time in seconds '1_0' is not a number",
    "\u0661": "is not a number",
    "-1": "--from: -1 s is negative",
    "soon": "--from: time in seconds 'soon' is not a number",
    "5": "--to lies before --from",
}


@pytest.mark.parametrize("time", TIMES)
@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_not_a_time_is_2(automax, command, time):
    result = automax(*COMMANDS[command], "--from", time, "--to", "4")
    assert (result.code, result.out) == (2, "")
    assert TIMES[time] in result.err


@pytest.mark.parametrize("command", ["export", "plot", "replay"])
def test_times_are_rounded_to_the_nearest_nanosecond(automax, command):
    assert automax(*COMMANDS[command], "--from", "9.9000000000001", "--to", "9.95").code == 0
