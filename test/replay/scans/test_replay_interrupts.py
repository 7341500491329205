"""Scans that interrupts start, recorded with inputs that freeze, execute again bit for bit."""

from pathlib import Path

import pytest
from rack.helpers import written_in

from automax_ros.cli.main import main

TASK = """\
100 COMMON ISCR%, PERIOD%, POSITION%, OUT%
110 LOCAL LAST%, SPEED%
500 EVENT NAME=SAMPLE, INTERRUPT_STATUS=ISCR%, TIMEOUT=6
600 PERIOD% = 43
610 ISCR% = 64
1000 CALL SCAN_LOOP(TICKS=4, EVENT=SAMPLE)
1010 CALL DIFFERENCE(INPUT1=POSITION%, INPUT2=LAST%, OUTPUT=SPEED%)
1020 CALL MOVE(INPUT1=POSITION%, INPUT2=SPEED%, OUTPUT1=LAST%, OUTPUT2=OUT%)
1030 END
"""
HOG = "10 LOCAL N%, M%\n20 CALL SCAN_LOOP(TICKS=1)\n30 FOR N% = 1 TO 300\n35 M% = N%\n40 NEXT N%\n50 END\n"
RACK = """\
rack: PM1
execution: {execution}
slots:
  0: {{module: 57C435, tasks: {{SPEED: {{priority: 5}}, HOG: {{priority: 4}}}}}}
  6: {{module: 57C411}}
common:
  POSITION%: {{slot: 6, register: 0, ros: in}}
  ISCR%: {{slot: 6, register: 3}}
  PERIOD%: {{slot: 6, register: 4}}
  OUT%:
"""
STIMULI = """\
- {at: 0.1, ramp: {POSITION%: {to: 3000, over: 0.5}}}
- {at: 0.7, stop_all: true}
- {at: 0.8, run_all: true}
- {at: 0.9, set: {POSITION%: -7}}
"""


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_recorded_run_replays_and_repeats(tmp_path: Path, capsys, execution):
    written_in(tmp_path, RACK.format(execution=execution), SPEED=TASK, HOG=HOG)
    (tmp_path / "stimuli.yaml").write_text(STIMULI)
    bags = [tmp_path / "one", tmp_path / "two"]
    for bag in bags:
        run = ["run", str(tmp_path / "rack.yaml"), "--simulated", "--duration", "1"]
        assert main([*run, "--stimuli", str(tmp_path / "stimuli.yaml"), "--record", str(bag)]) == 0
    assert (bags[0] / "scans_0.mcap").read_bytes() == (bags[1] / "scans_0.mcap").read_bytes()
    capsys.readouterr()
    assert main(["replay", str(bags[0])]) == 0
    assert "no difference" in capsys.readouterr().out
