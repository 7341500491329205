"""How `automax run` ends, and that one rack of a name runs at a time."""

import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from automax_ros.recordings.read.reader import BagReader
from system.support import STUCK, TYPES, Automax, Client, automax, automax_here, consecutive, ns, wait_until

READY = "Ctrl-C ends the run"


def shared_memory(pid: int) -> set[str]:
    """The files in /dev/shm that a process has to itself.

    Ports are shared with whatever else speaks DDS on this host, and others than DDS map files there too.
    """
    names = set(re.findall(r"/dev/shm/\S+", Path(f"/proc/{pid}/maps").read_text()))
    return {name for name in names if "lttng" not in name and "_port" not in name}


@pytest.mark.parametrize(
    "signals",
    [
        (signal.SIGINT,),
        (signal.SIGTERM,),
        (signal.SIGINT, signal.SIGINT),
        (signal.SIGTERM, signal.SIGINT, signal.SIGTERM),
    ],
    ids=lambda signals: "-".join(number.name for number in signals),
)
def test_stop_is_clean(ros_domain_id, tmp_path, signals):
    bag = tmp_path / "bag"
    with Automax("run", TYPES, "--record", bag) as process:
        process.wait_for_line(READY)
        wait_until(lambda: (bag / "scans_0.mcap").stat().st_size > 0)
        mapped = shared_memory(process.pid)
        ended = process.end(*signals)
    print(f"stopped {ended.seconds:.2f} s after {signals[0].name}")
    assert (ended.code, ended.err) == (0, "")
    assert mapped
    assert {name for name in mapped if Path(name).exists()} == set()
    assert re.search(r"ran \d+\.\d{3} s\n", ended.out)
    assert f"recorded {bag}" in ended.out
    messages = list(BagReader(bag).messages(topics={"/types/scans", "/types/backplane"}))
    numbers = [item.message.sequence for item in messages if item.topic == "/types/backplane"]
    assert numbers[0] == 1
    assert consecutive(numbers)
    with (bag / "scans_0.mcap").open("rb") as file:
        decoded = sum(1 for _ in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    assert decoded > len(messages)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("pause_s", [0.0, 0.3])
def test_stop_during_start_is_clean(ros_domain_id, tmp_path, number, pause_s):
    with Automax("run", TYPES, "--record", tmp_path / "bag") as process:
        process.wait_until_catching(signal.SIGTERM)
        time.sleep(pause_s)  # any moment of the start will do
        ended = process.end(number, number)
    assert (ended.code, ended.err) == (0, "")


@pytest.mark.soak
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stop_at_any_moment_is_clean(ros_domain_id, number):
    for step in range(60):
        with Automax("run", TYPES) as process:
            process.wait_until_catching(signal.SIGTERM)
            time.sleep(step * 0.02)
            ended = process.end(number, number)
        assert (ended.code, ended.err) == (0, ""), f"{step * 20} ms after the start"


def test_simulated_run_stops_on_a_signal(tmp_path):
    bag = tmp_path / "bag"
    with Automax("run", TYPES, "--simulated", "--duration", "1e6", "--record", bag) as process:
        process.wait_until_catching(signal.SIGTERM)
        file = bag / "scans_0.mcap"
        wait_until(lambda: file.exists() and file.stat().st_size > 0)
        ended = process.end(signal.SIGTERM)
    assert (ended.code, ended.err) == (0, "")
    assert next(BagReader(bag).messages()).topic == "/types/variables"


# One rack of a name


@pytest.fixture(scope="module")
def running(module_domain_id) -> Iterator[Automax]:
    with Automax("run", TYPES) as process:
        process.wait_for_line(READY)
        yield process
        assert process.end(signal.SIGINT).code == 0


def test_second_launch_is_refused(running, module_domain_id):
    ended = automax_here("run", TYPES, "--duration", "1")
    assert ended.code == 2
    assert ended.err == (
        f"automax run: error: rack /types in ROS domain {module_domain_id} runs already (process {running.pid}): "
        "stop it first, or set another ROS_DOMAIN_ID\n"
    )
    assert ended.out == ""


def test_another_domain_is_free(running, module_domain_id, ros_domain_id):
    assert ros_domain_id != module_domain_id
    ended = automax("run", TYPES, "--duration", "0.1")
    assert (ended.code, ended.err) == (0, "")
    assert f"in domain {ros_domain_id}, seen by this host;" in ended.out


def test_two_racks_share_a_domain(running, module_domain_id):
    from std_msgs.msg import Int32

    with Automax("run", STUCK) as other, Client() as client:
        other.wait_for_line(READY)
        counts = [client.listen(Int32, f"/{rack}/common/COUNT", latched=True, depth=1) for rack in ("types", "stuck")]
        client.until(lambda: all(len(found) > 10 for found in counts))
        assert other.end(signal.SIGTERM).code == 0
    assert running.process.poll() is None


def test_killed_rack_leaves_the_name_free(ros_domain_id):
    with Automax("run", TYPES) as process:
        process.wait_for_line(READY)
        mapped = shared_memory(process.pid)
        assert process.end(signal.SIGKILL).code == -signal.SIGKILL
    for name in mapped:
        Path(name).unlink(missing_ok=True)
    ended = automax("run", TYPES, "--duration", "0.1")
    assert (ended.code, ended.err) == (0, "")


def test_first_scan_comes_soon(ros_domain_id):
    """Prints how long it takes from the start of the program to the first scan; the promise is 3 s."""
    from automax_msgs.msg import VariableTable

    began = time.time()
    with Automax("run", TYPES) as process:
        process.wait_for_line(READY)
        with Client() as client:
            table = client.first(VariableTable, "/types/variables")
    took = ns(table.stamp) / 1e9 - began  # the table's stamp is rack time 0, when the first scans are due
    print(f"first scan {took:.2f} s after the start")
    assert took > 0


# Faults and wrong surroundings


def test_fault_stops_all_tasks(ros_domain_id):
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from std_msgs.msg import Bool, Int32

    with Automax("run", STUCK) as process, Client() as client:
        process.wait_for_line(READY)
        arrays = client.listen(DiagnosticArray, "/diagnostics")
        counts = client.listen(Int32, "/stuck/common/COUNT", latched=True, depth=1)
        client.until(lambda: bool(counts and arrays) and counts[-1].data > 0)
        client.send(Bool, "/stuck/common/GO/set", Bool(data=True))

        def levels() -> dict[str, bytes]:
            return {status.name: status.level for status in arrays[-1].status}

        client.until(lambda: levels()["stuck/processor_0: LOOP"] == DiagnosticStatus.ERROR)
        assert levels()["stuck/processor_0: OTHER"] == DiagnosticStatus.WARN
        client.until(lambda: counts[-1].data == 0)  # STOP ALL zeroes volatile commons
        process.wait_for_line("STOP ALL (code 14): task LOOP")
        ended = process.end(signal.SIGINT)
    assert ended.code == 1
    assert re.fullmatch(
        r"automax run: STOP ALL: task LOOP: scan \d+, line 110: AMX7040 .* \(code 14 on the rack\)\n", ended.err
    )


def test_missed_deadlines_are_told(ros_domain_id):
    """A host that stands still makes every task late; the next scans are on the grid again, and nothing stops."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

    with Automax("run", TYPES) as process, Client() as client:
        process.wait_for_line(READY)
        arrays = client.listen(DiagnosticArray, "/diagnostics")
        client.until(lambda: arrays)
        process.send(signal.SIGSTOP)
        time.sleep(0.3)  # as long as the host stands still: 120 scans of 2.5 ms are missed
        process.send(signal.SIGCONT)
        late = re.compile(r"AMX7042 deadlines missed since the last report: (\d+)")

        def missed() -> list[int]:
            found = [(status.level, late.fullmatch(status.message)) for array in arrays for status in array.status]
            return [int(match[1]) for level, match in found if match and level == DiagnosticStatus.WARN]

        client.until(lambda: any(count >= 50 for count in missed()))
        assert process.end(signal.SIGINT).code == 0


def test_fault_before_the_first_scan_is_told_once(ros_domain_id):
    ended = automax("run", STUCK, "--set", "GO@=1", "--duration", "0.5")
    assert ended.code == 1
    assert ended.err.count("STOP ALL") == 1
    assert "STOP ALL" in ended.out, "how it stands: in each status line, of which a busy host prints several"


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("ROS_DOMAIN_ID", "x", "ROS_DOMAIN_ID='x' is not a number from 0 to 232"),
        ("ROS_DOMAIN_ID", "500", "ROS_DOMAIN_ID='500' is not a number from 0 to 232"),
        ("ROS_LOG_DIR", "/dev/null/log", "ROS 2 does not start"),
    ],
)
def test_wrong_surroundings_are_a_message(ros_domain_id, variable, value, words):
    ended = automax("run", TYPES, "--duration", "0.1", environment={**os.environ, variable: value})
    assert ended.code == 2
    assert words in ended.err
    assert "Traceback" not in ended.err


def test_existing_folder_is_not_recorded_into(ros_domain_id, tmp_path):
    ended = automax("run", TYPES, "--duration", "0.1", "--record", tmp_path)
    assert ended.code == 2
    assert "AMX6800" in ended.err
    assert list(tmp_path.iterdir()) == []
