"""`automax record` with a running rack: the same messages as the rack's own recording, however late it joins."""

import re
import shutil
import signal
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest
from replay.reexecution import Reexecution

from automax_ros.core.ticks import NS_PER_S, NS_PER_US
from automax_ros.recordings.live.topics import GAPS_NAMED
from automax_ros.recordings.read.reader import BagReader
from system.support import TYPES, Automax, Client, automax, automax_here, consecutive, wait_until

READY = "Ctrl-C ends the run"
BEGUN = "recording since"
LOG = {"automax_msgs/msg/Scan", "automax_msgs/msg/CommonWrite", "automax_msgs/msg/TaskState"}
TASKS = {"FAST", "SLOW", "COPY"}


@pytest.fixture(scope="module")
def running(module_domain_id) -> Iterator[Automax]:
    with Automax("run", TYPES) as process:
        process.wait_for_line(READY)
        yield process


def log_of(bag: Path) -> list[Any]:
    """Scans, states and the write log, in their order."""
    return [item.message for item in BagReader(bag).messages(types=LOG)]


def is_scan(message: Any) -> bool:
    return hasattr(message, "latched")


def sequences(messages: list[Any]) -> list[int]:
    return [message.sequence for message in messages if hasattr(message, "sequence")]


def missing_writes(bag: Path) -> tuple[list[int], int]:
    """How many writes are missing before each image that is not the first; and the stamp of the last write.

    Nowhere else may one be missing.
    """
    missing: list[int] = []
    sequence, stamp = -1, -1
    for item in BagReader(bag).messages(types={"automax_msgs/msg/CommonImage", "automax_msgs/msg/CommonWrite"}):
        number = item.message.sequence
        if item.type_name.endswith("CommonImage"):
            missing += [number - sequence] if 0 <= sequence < number else []
        else:
            assert number == sequence + 1
            stamp = item.message.stamp
        sequence = number
    return missing, stamp


def began_ns(reader: BagReader) -> int:
    """The wall clock at rack time 0, which a recording's times in seconds count from."""
    (table,) = (item.message for item in reader.messages(types={"automax_msgs/msg/VariableTable"}))
    return int(table.stamp)


def first_difference(ours: list[Any], theirs: list[Any]) -> str:
    """The first message that differs, with those around it; empty where the two are the same."""
    for number, (own, other) in enumerate(zip_longest(ours, theirs)):
        if own != other:
            lines = [f"message {number} of {len(ours)} differs:"]
            for name, messages in (("ours", ours), ("theirs", theirs)):
                lines += [f"  {name}: {item}" for item in messages[max(0, number - 1) : number + 3]]
            return "\n".join(lines)
    return ""


def size_of(bag: Path) -> int:
    return (bag / "scans_0.mcap").stat().st_size if (bag / "scans_0.mcap").exists() else 0


@pytest.mark.timeout(300)
def test_recording_is_the_racks_own_over_the_common_span(ros_domain_id, tmp_path):
    from std_msgs.msg import Int16

    own, bag = tmp_path / "own", tmp_path / "bag"
    with Automax("run", TYPES, "--record", own) as rack:
        rack.wait_for_line(READY)
        wait_until(lambda: size_of(own) > 20_000)
        with Automax("record", "TYPES", "--output", bag) as recorder, Client() as client:
            recorder.wait_for_line(BEGUN)
            names = client.node.get_node_names_and_namespaces
            client.until(lambda: ("recorder", "/types") in names(), "the node recorder")
            doubled = client.listen(Int16, "/types/common/TWICE", latched=True, depth=1)
            client.send(Int16, "/types/common/REF/set", Int16(data=-321))
            client.until(lambda: bool(doubled) and doubled[-1].data == -642)
            grown = size_of(bag) + 30_000
            wait_until(lambda: size_of(bag) > grown)
            ended = recorder.end(signal.SIGTERM)
        assert rack.end(signal.SIGINT).code == 0
    print(f"stopped {ended.seconds:.2f} s after SIGTERM")
    assert (ended.code, ended.err) == (0, "")
    assert re.search(r"replayable from \d+\.\d{3} s on\n", ended.out)
    assert "lacks" not in ended.out

    reader, other = BagReader(bag), BagReader(own)
    theirs, ours = log_of(own), log_of(bag)
    # Before it is replayable a state may lack: the reader of scans was met, and answered, before that of states.
    since_ns = began_ns(other) + round(float(reader.custom_data["replayable_from_s"]) * NS_PER_S) + NS_PER_US
    common = ours[next(n for n, item in enumerate(ours) if is_scan(item) and item.stamp > since_ns) :]
    start = theirs.index(common[0])
    assert len(common) > 200
    assert {item.task for item in common if is_scan(item)} == TASKS
    assert first_difference(common, theirs[start : start + len(common)]) == ""
    assert consecutive(sequences(ours))
    for task in TASKS:
        numbers = [item.scan for item in ours if is_scan(item) and item.task == task]
        assert numbers[0] > 1
        assert consecutive(numbers)

    assert {item.name: item.data for item in reader.attachments()} == {
        item.name: item.data for item in other.attachments()
    }
    assert reader.custom_data["fingerprint"] == other.custom_data["fingerprint"]
    assert "gaps" not in reader.custom_data
    # The rack answers who joins at once: its own states and full scans come every 10 s.
    (begun_s,) = re.findall(r"recording since (\d+\.\d{3}) s", ended.out)
    assert float(reader.custom_data["replayable_from_s"]) - float(begun_s) < 5.0
    values = [item.message.data for item in reader.messages(topics={"/types/common/TWICE"})]
    assert values == [2000, -642]
    (tmp_path / "again").mkdir()
    assert set(Reexecution(bag, tmp_path / "again").execute().scans) == TASKS


def test_replay_of_a_live_recording_finds_no_difference(running, tmp_path):
    bag = tmp_path / "bag"
    ended = automax("record", "/types", "--output", bag, "--duration", "1", "--tasks", "fast,COPY")
    assert (ended.code, ended.err) == (0, "")
    assert {item.task for item in log_of(bag) if is_scan(item)} == {"FAST", "COPY"}
    replayed = automax_here("replay", bag)
    assert (replayed.code, replayed.err) == (0, "")


def test_a_recording_without_a_scan_is_no_success(ros_domain_id, tmp_path):
    """The tasks of the rack do not run: nothing of the recording could be replayed."""
    stop = tmp_path / "stop.yaml"
    stop.write_text("- {at: 0, stop_all: true}\n")
    with Automax("run", TYPES, "--stimuli", stop) as process:
        process.wait_for_line(READY)
        ended = automax("record", "TYPES", "--output", tmp_path / "bag", "--duration", "0.5")
    assert (ended.code, ended.err) == (1, "")
    assert "it holds no scan: nothing of it can be replayed; do the tasks run?" in ended.out


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stop_before_anything_came_is_clean(ros_domain_id, tmp_path, number):
    with Automax("record", "TYPES", "--output", tmp_path / "bag", "--wait", "100") as recorder:
        recorder.wait_until_catching(signal.SIGTERM)
        ended = recorder.end(number, number)
    assert (ended.code, ended.err) == (0, "")
    assert not (tmp_path / "bag").exists()


def test_stopped_recorder_tells_the_gap_and_goes_on_from_a_new_image(running, tmp_path):
    from automax_msgs.msg import CommonWrite

    bag = tmp_path / "bag"
    with Automax("record", "TYPES", "--output", bag) as recorder, Client() as client:
        recorder.wait_for_line(BEGUN)
        wait_until(lambda: size_of(bag) > 20_000)
        writes = client.listen(CommonWrite, "/types/backplane")
        client.until(lambda: bool(writes))
        recorder.send(signal.SIGSTOP)
        # The rack keeps 1000 writes for those who lag behind; far more are lost.
        client.until(lambda: writes[-1].sequence > writes[0].sequence + 3000)
        recorder.send(signal.SIGCONT)
        recorder.wait_for_line("writes of common memory did not come")
        grown = size_of(bag) + 30_000
        wait_until(lambda: size_of(bag) > grown)
        ended = recorder.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")
    assert re.search(r"  gap at \d+\.\d{3} s: \d+ writes of common memory\n", ended.out)
    # DDS may lose writes again while it catches up on a busy machine: each gap is told, whole, and no other.
    missing, last = missing_writes(bag)
    assert missing
    told = re.fullmatch(r"(\d+): (.*)", BagReader(bag).custom_data["gaps"])
    assert told is not None
    gaps = told[2].split("; ")
    assert len(gaps) == min(int(told[1]), GAPS_NAMED)
    of_writes = [gap.partition(" s: ") for gap in gaps if gap.endswith("writes of common memory")]
    if len(of_writes) > len(missing):  # the recording ended before the rack's image came
        stamp_s, _, _ = of_writes.pop()
        assert float(stamp_s) > (last - began_ns(BagReader(bag))) / 1e9
    elif int(told[1]) > GAPS_NAMED:
        del missing[len(of_writes) :]
    assert [what for _, _, what in of_writes] == [f"{count} writes of common memory" for count in missing]
    replayed = automax_here("replay", bag)
    assert (replayed.code, replayed.err) == (0, "")


def test_restarted_rack_ends_the_recording(ros_domain_id, tmp_path):
    bag = tmp_path / "bag"
    with Automax("run", TYPES) as rack:
        rack.wait_for_line(READY)
        with Automax("record", "TYPES", "--output", bag) as recorder:
            recorder.wait_for_line(BEGUN)
            wait_until(lambda: size_of(bag) > 20_000)
            assert rack.end(signal.SIGINT).code == 0
            with Automax("run", TYPES) as second:
                second.wait_for_line(READY)
                ended = recorder.end()
    assert (ended.code, ended.err) == (1, "")
    assert "the rack was started again: the recording ends here" in ended.out
    runs = {item.message.run_id for item in BagReader(bag).messages(types={"automax_msgs/msg/CommonWrite"})}
    assert len(runs) == 1
    final = [item for item in log_of(bag) if not is_scan(item) and hasattr(item, "task")][-3:]
    last = {item.task: item.scan for item in log_of(bag) if is_scan(item)}
    assert {item.task: item.scan for item in final} == last, "the states in which the tasks were stopped"


# What it is asked for


def test_racks_that_are_there_are_named(running, tmp_path):
    for wait_s in ("3", "15"):  # on a busy machine it may not have been seen
        ended = automax_here("record", "TIPES", "--output", tmp_path / "bag", "--wait", wait_s)
        if "no rack is there" not in ended.err:
            break
    assert ended.code == 2
    assert "no rack /tipes in ROS domain" in ended.err
    assert "did you mean /types?" in ended.err
    assert not (tmp_path / "bag").exists()


def test_no_rack_at_all(ros_domain_id, tmp_path):
    ended = automax_here("record", "TYPES", "--output", tmp_path / "bag", "--wait", "0.5")
    assert ended.code == 2
    assert "within 0.5 s; no rack is there\n  hint: start the rack first" in ended.err


def test_unknown_task_is_refused(running, tmp_path):
    ended = automax_here("record", "TYPES", "--output", tmp_path / "bag", "--tasks", "FASTER")
    assert ended.code == 2
    assert ended.err == "automax record: error: --tasks: no task 'FASTER'\n  hint: did you mean FAST?\n"
    assert not (tmp_path / "bag").exists()


def test_existing_folder_is_not_recorded_into(tmp_path):
    ended = automax_here("record", "TYPES", "--output", tmp_path)
    assert ended.code == 2
    assert "AMX6800" in ended.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("a b",), "neither a rack's name or namespace nor a YAML file"),
        (("none.yaml",), "none.yaml: the rack file cannot be read"),
        (("TYPES", "--duration", "0"), "--duration: 0 s is too short: give more"),
        (("TYPES", "--wait", "x"), "--wait: "),
    ],
)
def test_wrong_usage(ros_domain_id, arguments, words):
    ended = automax_here("record", *arguments)
    assert ended.code == 2
    assert words in ended.err
    assert "Traceback" not in ended.err


def test_yaml_file_names_the_rack_and_is_compared_with_what_runs(running, tmp_path):
    folder = tmp_path / "edited"
    shutil.copytree(TYPES.parent, folder)
    source = folder / "SLOW.BLK"
    source.write_text(source.read_text() + "\n")
    bag = tmp_path / "bag"
    ended = automax("record", folder / "rack.yaml", "--output", bag, "--duration", "0.2")
    assert (ended.code, ended.err) == (0, "")
    assert "warning: SLOW.BLK on disk is not what runs; the bag stores what runs\n" in ended.out
    assert ended.out.count("warning") == 1
    stored = {item.name: item.data for item in BagReader(bag).attachments()}
    assert stored["SLOW.BLK"] == (TYPES.parent / "SLOW.BLK").read_bytes()


def test_folder_that_vanishes_is_one_error_that_names_the_cure(running, tmp_path):
    """As a disk that is pulled out."""
    bag = tmp_path / "bag"
    with Automax("record", "TYPES", "--output", bag) as recorder:
        recorder.wait_for_line(BEGUN)
        shutil.rmtree(bag)
        ended = recorder.end(signal.SIGINT)
    assert ended.code == 1
    assert ended.err.count("error[AMX6801]") == 1
    assert "`automax bag repair`" in ended.err
    assert "Traceback" not in ended.err
