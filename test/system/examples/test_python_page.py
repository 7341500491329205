"""The examples of docs/python.md, each run as it stands there."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from system.support import PATIENCE_S

ROOT = Path(__file__).parents[3]
EXAMPLES = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(encoding="utf-8"), re.S)
SIMULATED, OPERATED, REAL_TIME, IN_ROS, TWO_RACKS = EXAMPLES


NETWORK = re.compile(
    r"\[(WARN|INFO)\] \[[0-9.]+\] \[(line1|wind1)\.network_[58]\]: network PAPER: "
    r"(code C: nothing comes from|hears) drops [03]\n"
)


def ran(program: str, domain: int, *, has_network: bool = False) -> str:
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    result = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=environment,
        timeout=PATIENCE_S,
        check=False,
    )
    said = result.stderr
    if has_network:
        check_network([(found[2], found[1]) for found in NETWORK.finditer(said)])
        said = NETWORK.sub("", said)
    assert (result.returncode, said) == (0, "")
    return result.stdout


def check_network(said: list[tuple[str, str]]) -> None:
    """Check what two stations say of each other: a host that stops for 22 ms is code C, and is over when it goes on.

    The winder leaves first; where that takes long the line's last word is that nothing comes from it any more.
    """
    for station, last in (("line1", ("INFO", "WARN")), ("wind1", ("INFO",))):
        levels = [level for name, level in said if name == station]
        assert levels == [("WARN", "INFO")[number % 2] for number in range(len(levels))], said
        assert not levels or levels[-1] in last, said


def test_a_rack_in_simulated_time(ros_domain_id):
    assert int(ran(SIMULATED, ros_domain_id)) > 0


def test_a_rack_that_is_operated(ros_domain_id):
    goes_on = "rack.run(1.0)\nassert rack.state() == twin.state()\nprint(len(rack.tasks), rack.value('SECT_REF%'))"
    assert ran(f"{SIMULATED}\n{OPERATED}\n{goes_on}", ros_domain_id).split()[2:] == ["1200"]


def test_a_rack_in_real_time_without_ros(ros_domain_id):
    assert "10 * NS_PER_S" in REAL_TIME
    short = REAL_TIME.replace("10 * NS_PER_S", "NS_PER_S // 2")
    program = f"{SIMULATED}\n{short}\nprint(rack.now_ns, any('rclpy' in name for name in __import__('sys').modules))"
    assert ran(program, ros_domain_id).split()[1:] == ["500000000", "False"]


def test_a_rack_in_a_process_and_executor_of_its_user(ros_domain_id):
    seen = json.loads(ran(IN_ROS, ros_domain_id))
    assert len(seen) == 20
    assert seen == sorted(seen), "the ramp of the line goes up"


def test_two_racks_in_one_process_and_an_executor_with_threads(ros_domain_id):
    """What the winder knows of the line came over their network; the executor's thread has ended."""
    assert int(ran(TWO_RACKS, ros_domain_id, has_network=True)) > 10
