"""`automax trace --stimuli`: values by time for a task alone, with a table or without one."""

import pytest

from cli.support import TASK, Result, columns_of

# TASK scans each 11 ms and adds STEPS% to COUNT!


@pytest.fixture
def trace(automax):
    """Trace the task of the other tests with stimuli."""
    automax.write("TASK.BLK", TASK)

    def call(stimuli: str, *options: str) -> Result:
        return automax("trace", "TASK.BLK", "--stimuli", automax.write("stimuli.yaml", stimuli), *options)

    return call


def test_values_by_time(trace):
    text = (
        "- {at: 0.0, set: {GAIN: 2.5, TABLE%(3): 4}}\n- {at: 0.022, set: {REF%: 10}}\n"
        "- {at: 0.0220001, set: {REF%: 20}}\n- {at: 0.03, square: {RUN@: {hz: 20, for: 0.05}}}\n"
    )
    result = trace(text, "--duration", "0.1", "--watch", "REF%,OUT%,SCALED,RUN@")
    assert (result.code, result.err) == (0, "")
    columns = columns_of(result.out)
    assert columns["time_s"] == [f"{11 * number / 1000:g}" for number in range(10)]
    assert columns["REF%"] == ["0", "0", "10"] + ["20"] * 7
    assert columns["OUT%"] == ["4", "4", "14"] + ["24"] * 7
    assert columns["SCALED"][:3] == ["10.0", "10.0", "35.0"]
    # high from 30 ms on for 25 ms, low from 55 to 80 ms
    assert columns["RUN@"] == ["0", "0", "0", "1", "1", "0", "0", "0", "0", "0"]


def test_a_ramp_is_at_its_sample_before_each_scan(trace):
    result = trace("- {at: 0.0005, ramp: {REF%: {to: 100, over: 0.1}}}\n", "--duration", "0.13", "--watch", "REF%")
    # samples at 0.5 ms, 1.5 ms ...: at 11 ms the last one was after 10 ms of the ramp
    assert columns_of(result.out)["REF%"] == ["0", "10", "21", "32", "43", "54", "65", "76", "87", "98", "100", "100"]


def test_a_cell_has_the_last_word(automax, trace):
    automax.write("IN.csv", "REF%\n1\n\n3\n")
    result = trace("- {at: 0, set: {REF%: 7}}\n- {at: 0.011, set: {REF%: 8}}\n", "--input", "IN.csv")
    assert columns_of(result.out)["REF%"] == ["1", "8", "3"]


def test_the_shorter_of_table_and_duration_counts(automax, trace):
    automax.write("IN.csv", "REF%\n1\n2\n3\n")
    for duration, scans in (("0.022", 2), ("0.0221", 3), ("9", 3)):
        result = trace("[]\n", "--input", "IN.csv", "--duration", duration)
        assert len(columns_of(result.out)["scan"]) == scans


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        ("- {at: 0, set: {GAIN: 11}}\n", "AMX6736", "1:23"),
        ("- {at: 0, force: {REF%: 1}}\n", "AMX6733", "1:11"),
        ("- {at: 0, stop: [TASK]}\n", "AMX6733", "1:11"),
        ("- {at: 0, set: {NOWHERE%: 1}}\n", "AMX6735", "1:17"),
    ],
)
def test_errors_are_told_before_the_trace(trace, text, code, place):
    result = trace(text, "--duration", "1")
    assert (result.code, result.out) == (1, "")
    assert f"stimuli.yaml:{place}: error[{code}]" in result.err


@pytest.mark.parametrize(
    ("text", "last"),
    [
        ("[]\n", 0),
        ("- {at: 0.02, set: {REF%: 1}}\n", 22),
        ("- {at: 0.022, set: {REF%: 1}}\n", 22),
        ("- {at: 0.02, ramp: {REF%: {to: 9, over: 0.0241}}}\n", 55),
        ("- {at: 0.02, square: {RUN@: {hz: 9, for: 0.03}}}\n- {at: 0, set: {REF%: 1}}\n", 55),
    ],
)
def test_without_a_table_and_a_duration_the_last_entry_ends_a_trace(trace, text, last):
    assert columns_of(trace(text).out)["time_s"][-1] == f"{last / 1000:g}"


def test_a_wave_without_an_end_needs_a_duration(trace):
    result = trace("- {at: 0, sine: {REF%: {amplitude: 9, hz: 9}}}\n")
    assert (result.code, result.out) == (2, "")
    assert "give --duration S" in result.err


@pytest.mark.parametrize("options", [(), ("--duration", "1")])
def test_a_trace_needs_something_to_work_on(automax, trace, options):
    trace("[]\n", "--duration", "1")
    result = automax("trace", "TASK.BLK", *options)
    assert result.code == 2
    assert "--input" in result.err


def test_what_stands_before_scan_loop_sees_the_entries_of_0(automax):
    automax.write(
        "TASK.BLK",
        "10 COMMON REF%\n20 LOCAL KP [CURRENT=1.0, HIGH=9.0], OWN%, SEEN%, GAIN\n30 SEEN% = REF% + OWN%\n40 GAIN = KP\n"
        "50 CALL SCAN_LOOP(TICKS=2)\n60 END\n",
    )
    automax.write("stimuli.yaml", "- {at: 0, set: {REF%: 7, KP: 2.5, OWN%: 30}}\n- {at: 0.000001, set: {REF%: 8}}\n")
    result = automax("trace", "TASK.BLK", "--stimuli", "stimuli.yaml", "--duration", "0.02")
    assert (result.code, result.err) == (0, "")
    columns = columns_of(result.out)
    assert (columns["SEEN%"], columns["GAIN"], columns["REF%"]) == (["37", "37"], ["2.5", "2.5"], ["7", "8"])


def test_a_historians_table_drives_a_task_alone(automax, trace):
    """TASK scans at 0, 11 ms, 22 ms ...; the rows hold, numbers go in lines with `linear`, and GAIN has its limits."""
    automax.write("shift.csv", "t,ref,gain\n50,0,1\n50.022,22,2\n50.044,22,3\n")
    entry = "- {{at: 0, table: {{file: shift.csv, time: t, columns: {{REF%: ref, GAIN: gain}}, hold: {}}}}}\n"
    held = columns_of(trace(entry.format("true"), "--watch", "REF%,GAIN").out)
    assert (held["REF%"], held["GAIN"]) == (["0", "0", "22", "22", "22"], ["1.0", "1.0", "2.0", "2.0", "3.0"])
    lines = columns_of(trace(entry.format("linear"), "--watch", "REF%,GAIN").out)
    assert (lines["REF%"], lines["GAIN"]) == (["0", "11", "22", "22", "22"], ["1.0", "1.5", "2.0", "2.5", "3.0"])
    automax.write("shift.csv", "t,ref,gain\n50,0,11\n")
    told = trace(entry.format("true")).err
    assert "shift.csv:2: column 'gain': '11' cannot be used: GAIN takes a number from 0.0 to 10.0" in told
    automax.write("outside.csv", "t,ref,gain\n0,0,1\n")
    outside = trace(entry.format("true").replace("shift", "../outside"))
    assert "lies outside the folder of the stimuli file" in outside.err


def test_inputs_that_neither_table_nor_stimuli_set_are_named(automax, trace):
    automax.write("IN.csv", "REF%\n1\n")
    told = trace("- {at: 0, set: {RUN@: true}}\n", "--input", "IN.csv").err
    assert told == ""
    automax.write("IN.csv", "RUN@\n1\n")
    assert "TASK: IN.csv does not set REF%: it stays 0" in trace("[]\n", "--input", "IN.csv").err
    assert trace("- {at: 0, set: {REF%: 1}}\n", "--input", "IN.csv").err == ""
