"""What outlives a run, as a person sees it: `automax run` stopped and started again, simulated runs with --state."""

import signal
from pathlib import Path

import pytest

from system.support import Automax, Client, automax, automax_here

RACK = """\
rack: KEEP
slots:
  0: {module: 57C435, tasks: {T: {priority: 5}}}
common:
  LEVEL%: {non_volatile: true, ros: in}
  COPY%: {ros: out}
"""
TASK = """\
10 COMMON LEVEL%, COPY%
20 LOCAL K% [CURRENT=2, LOW=0, HIGH=10]
100 CALL SCAN_LOOP(TICKS=1)
110 COPY% = LEVEL% * K%
120 END
"""
READY = "Ctrl-C ends the run"


@pytest.fixture
def rack(tmp_path) -> Path:
    (tmp_path / "T.BLK").write_text(TASK)
    path = tmp_path / "rack.yaml"
    path.write_text(RACK)
    return path


def test_values_survive_a_restart(ros_domain_id, rack, tmp_path):
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import GetParameters, SetParameters
    from std_msgs.msg import Int16

    state = tmp_path / ".automax" / "KEEP"
    with Client() as client:
        copies = client.listen(Int16, "/keep/common/COPY", latched=True, depth=1)
        with Automax("run", rack, "--state", state) as process:
            process.wait_for_line(READY)
            client.send(Int16, "/keep/common/LEVEL/set", Int16(data=70))
            tuning = client.node.create_client(SetParameters, "/keep/processor_0/set_parameters")
            client.until(tuning.service_is_ready)
            value = ParameterValue(type=2, integer_value=3)
            request = SetParameters.Request(parameters=[Parameter(name="T.K", value=value)])
            assert client.result(tuning.call_async(request)).results[0].successful
            client.until(lambda: copies and copies[-1].data == 210)
            assert process.end(signal.SIGINT).code == 0
        copies.clear()
        with Automax("run", rack, "--state", state) as process:
            process.wait_for_line("kept from the last run: 1 common, 1 tunable")
            client.until(lambda: copies and copies[-1].data == 210)
            asking = client.node.create_client(GetParameters, "/keep/processor_0/get_parameters")
            client.until(asking.service_is_ready)
            found = client.result(asking.call_async(GetParameters.Request(names=["T.K"])))
            assert found.values[0].integer_value == 3
            assert process.end(signal.SIGINT).code == 0


def test_simulated_run_keeps_nothing_unless_asked(rack):
    run = ("run", rack, "--simulated", "--duration", "0.1", "--watch", "LEVEL%")
    assert automax_here(*run, "--set", "LEVEL%=9").code == 0
    assert sorted(path.name for path in rack.parent.iterdir()) == ["T.BLK", "rack.yaml"]
    assert "LEVEL%=0" in automax_here(*run).out


def test_simulated_runs_with_a_state_go_on_from_each_other(rack):
    run = ("run", rack, "--simulated", "--duration", "0.1", "--state", rack.parent / "kept", "--watch", "LEVEL%")
    assert automax_here(*run, "--set", "LEVEL%=9").code == 0
    second = automax_here(*run)
    assert "LEVEL%=9" in second.out
    assert "kept from the last run: 1 common, 0 tunables" in second.out
    assert "LEVEL%=4" in automax_here(*run, "--set", "LEVEL%=4").out, "what is set wins over what was kept"


def test_recording_of_a_run_with_a_state_replays(rack):
    """What came back stands in the recording as a write, and the tunable in the states."""
    state, bag = rack.parent / "kept", rack.parent / "bag"
    run = ("run", rack, "--simulated", "--duration", "0.1", "--state", state)
    assert automax_here(*run, "--set", "LEVEL%=9").code == 0
    text = (state / "state.json").read_text()
    (state / "state.json").write_text(text.replace('"K%": 2', '"K%": 5'))
    ended = automax_here(*run, "--record", bag, "--watch", "COPY%")
    assert "COPY%=45" in ended.out
    replayed = automax_here("replay", bag)
    assert replayed.code == 0, replayed.out + replayed.err


COUNTING = """\
10 COMMON LEVEL%, COPY%
20 LOCAL BEGUN%, N%, LIST%(3)
30 BEGUN% = BEGUN% + 1
40 LEVEL% = BEGUN% * 1000 + N%
100 CALL SCAN_LOOP(TICKS=1)
110 N% = N% + 1
120 LIST%(BEGUN%) = N%
130 COPY% = LIST%(1)
140 END
"""


def test_locals_of_the_last_run_stand_in_the_recording_before_the_start(rack):
    (rack.parent / "T.BLK").write_text(COUNTING)
    run = ("run", rack, "--simulated", "--duration", "0.1", "--state", rack.parent / "kept")
    assert automax_here(*run).code == 0
    ended = automax_here(*run, "--record", rack.parent / "bag", "--watch", "LEVEL%,COPY%")
    assert "LEVEL%=2019" in ended.out
    assert "COPY%=19" in ended.out
    replayed = automax_here("replay", rack.parent / "bag")
    assert replayed.code == 0, replayed.out + replayed.err


@pytest.mark.parametrize("simulated", [True, False])
def test_damaged_state_is_a_clear_error(ros_domain_id, rack, simulated):
    state = rack.parent / "kept"
    state.mkdir()
    (state / "state.json").write_text("{")
    program, how = (automax_here, ("--simulated",)) if simulated else (automax, ())
    ended = program("run", rack, *how, "--duration", "0.1", "--state", state)
    assert ended.code == 2
    assert "state.json: error[AMX6711]: the kept state is damaged: " in ended.err
    assert "hint: remove it to start the rack as installed" in ended.err


def test_folder_that_cannot_be_one_is_refused_before_the_run(rack):
    (rack.parent / "kept").write_text("a file stands there")
    ended = automax_here("run", rack, "--simulated", "--duration", "0.1", "--state", rack.parent / "kept")
    assert ended.code == 2
    assert "kept is not a folder" in ended.err
    assert "ran" not in ended.out


def test_folder_that_goes_while_the_rack_runs_is_told(ros_domain_id, rack):
    kept = rack.parent / "kept"
    kept.mkdir()
    with Automax("run", rack, "--state", kept, "--set", "LEVEL%=9") as process:
        process.wait_for_line("Ctrl-C ends the run")
        kept.rmdir()
        kept.write_text("a file stands there")
        ended = process.end(signal.SIGINT)
    assert ended.code == 1
    assert "values of this run will not outlive it: " in ended.out
