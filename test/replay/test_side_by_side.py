"""Files of split recordings replayed side by side: the report is that of one job, whatever the recording holds.

Most tests do the parts in this process: what is proven of them does not depend on who does them. Those at the end use
processes and a cluster.
"""

import random
import shutil
import signal

import pytest
from parallel.clusters import cluster

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.parallel.job import JobFault, JobResult, Workers, result_of
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.metadata import METADATA_FILE
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay import side_by_side
from automax_ros.replay.columns.forms import ColumnForms
from automax_ros.replay.engine import Replay, ReplayOptions
from automax_ros.replay.part import Part
from automax_ros.replay.side_by_side import parts_of, replay_side_by_side
from replay.replays import SPEED, WORK, YAML, edited, record, recorded, rewritten
from replay.test_operated_rack import LISTEN, make, operate
from replay.test_operated_rack import WORK as OPERATED_WORK

QUARTERS = RecordingOptions(split_ns=NS_PER_S // 4)
"""Eight files of two seconds."""
MODELED = "rack: LINE1\nexecution: modeled\n" + YAML.partition("\n")[2]


@pytest.fixture(autouse=True)
def both_ways(monkeypatch, column_library):
    """Other tests prove that columns and scan by scan give one report; here the other way is in parts."""
    monkeypatch.setattr(ColumnForms, "library", column_library)


@pytest.fixture(autouse=True)
def each_file_is_a_part(monkeypatch):
    monkeypatch.setattr(side_by_side, "LEAST_PART_BYTES", 1)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("plain"), options=QUARTERS)


class Here:
    """Does pieces in this process; ``done`` counts them, ``gone_on`` the files that were done again in one go."""

    def __init__(self, monkeypatch):
        self.parts = []
        self.passes = 0
        run = Replay.run

        def pieces(wanted, where, on_done, should_stop):
            for piece in wanted:
                if should_stop():
                    break
                self.parts.append(piece.name)
                on_done(result_of(piece))

        def whole(*arguments):
            self.passes += 1
            return run(*arguments)

        monkeypatch.setattr(side_by_side, "run_jobs", pieces)
        monkeypatch.setattr(Replay, "run", whole)


def prepared(bag, new=None, **options):
    suffixes = {"LISTEN": "BAS"}
    sources = {name: SourceText(f"{name}.{suffixes.get(name, 'BLK')}", text) for name, text in (new or {}).items()}
    return Replay(bag, sources, ReplayOptions(**options))


def outcome(do):
    try:
        return do()
    except BagError as error:
        return str(error)


def compare(monkeypatch, bag, new=None, **options):
    """Replay in one go and in parts; return the report and how it was done."""
    replay = prepared(bag, new, **options)
    expected = outcome(lambda: replay.run(None))
    with monkeypatch.context() as patch:
        here = Here(patch)
        found = outcome(lambda: replay_side_by_side(replay, Workers(2)))
    assert found == expected
    if not isinstance(found, str):
        assert found.text() == expected.text()
    return found, here


def test_all_files_are_proven_by_themselves(monkeypatch, plain):
    report, here = compare(monkeypatch, plain)
    assert report.identical
    assert report.scans > 500
    assert here.parts == [f"scans_{number}.mcap" for number in range(8)]
    assert here.passes == 0


def test_modeled_scans_that_last_over_the_end_of_a_file_are_proven(monkeypatch, tmp_path):
    work = edited(WORK, ("190 IF OUT%", "185 FOR I% = 1 TO 60\n186 TOTAL = TOTAL * 0.99\n187 NEXT I%\n190 IF OUT%"))
    options = RecordingOptions(split_ns=NS_PER_S // 40)
    bag = recorded(tmp_path, seconds=0.8, yaml=MODELED, options=options, WORK=work)
    report, here = compare(monkeypatch, bag)
    assert report.identical
    assert len(here.parts) > 25
    assert here.passes == 0


@pytest.mark.parametrize("number", [0, 1, 5, 7])
def test_a_difference_is_told_as_in_one_go(monkeypatch, plain, tmp_path, number):
    """One recorded value of one file is another: from this file on it is done in one go, with what was before."""
    bag = tmp_path / "bag"
    shutil.copytree(plain, bag)
    file = f"scans_{number}.mcap"
    (bag / file).unlink()
    others = rewritten(plain / file, tmp_path / "changed", Changed())
    shutil.move(others / "scans_0.mcap", bag / file)
    report, here = compare(monkeypatch, bag)
    assert not report.identical
    assert report.first.time_s >= number / 4
    assert len(here.parts) == number + 1
    assert here.passes == (0 if number else 1)


class Changed:
    """Changes what the fiftieth scan of the task SPEED committed."""

    def __init__(self):
        self.left = 20

    def __call__(self, message):
        if type(message).__name__ == "Scan" and message.task == "SPEED" and message.committed.value:
            self.left -= 1
            if not self.left:
                values = message.committed._replace(value=[value + 1 for value in message.committed.value])
                return message._replace(committed=values)
        return message


EDITS = {
    "a comment": {"SPEED": edited(SPEED, ("120 CALL LAG", "115 REM the same\n120 CALL LAG"))},
    "a gain": {"SPEED": edited(SPEED, ("WLG=10.0", "WLG=20.0"))},
    "an operand that matters late": {"WORK": edited(WORK, ("COUNT! + 1", "COUNT! + 1 - (COUNT! > 150)"))},
    "a variable of its own": {
        "WORK": edited(WORK, ("J%, NIL%\n", "J%, NIL%, EXTRA%\n"), ("180 FLAG", "175 EXTRA% = EXTRA% + 1\n180 FLAG"))
    },
    "a tunable": {"SPEED": edited(SPEED, ("CURRENT=1,", "CURRENT=2,"))},
    "an end": {"WORK": edited(WORK, ("180 FLAG", "175 IF COUNT! > 150 THEN STOP\n180 FLAG"))},
    "a period": {"WORK": edited(WORK, ("TICKS=2", "TICKS=4"))},
}


@pytest.mark.parametrize("what", EDITS)
def test_edited_tasks_are_told_as_in_one_go(monkeypatch, plain, what):
    report, here = compare(monkeypatch, plain, EDITS[what])
    if what == "a comment":
        assert report.identical
        assert (len(here.parts), here.passes) == (8, 0)


def test_recorded_ends_are_told_as_in_one_go(monkeypatch, tmp_path):
    work = WORK.replace("180 FLAG", "175 IF COUNT! > 60 THEN STOP\n180 FLAG")
    bag = recorded(tmp_path, options=QUARTERS, WORK=work)
    report, here = compare(monkeypatch, bag)
    assert report.identical
    assert here.passes == 0
    report, _ = compare(monkeypatch, bag, {"WORK": WORK})
    assert not report.identical


@pytest.mark.parametrize(
    ("options", "edited_too"),
    [
        ({"from_ns": NS_PER_S}, False),
        ({"from_ns": NS_PER_S + 17}, True),
        ({"from_ns": 1_300_000_000, "to_ns": 1_400_000_000}, True),
        ({"to_ns": 300_000_000}, True),
        ({"to_ns": NS_PER_S // 4}, False),
        ({"from_ns": 1_990_000_000}, False),
        ({"from_ns": 3 * NS_PER_S}, False),
        ({"only": ("WORK",)}, False),
        ({"only": ("SPEED",), "from_ns": 700_000_000}, True),
        ({"tolerance": 1.0}, True),
        ({"max_differences": 1}, True),
    ],
    ids=str,
)
def test_ranges_and_choices_are_those_of_one_go(monkeypatch, plain, options, edited_too):
    compare(monkeypatch, plain, **options)
    if edited_too:
        compare(monkeypatch, plain, EDITS["a gain"], **options)


@pytest.mark.parametrize(("execution", "split_ms"), [("ideal", 100), ("modeled", 130)])
def test_an_operated_rack_with_basic_tasks_is_told_as_in_one_go(monkeypatch, tmp_path, execution, split_ms):
    """Forces, tunables, reloads, STOP ALL, power: at the ends of files, and amid them."""
    options = RecordingOptions(split_ns=split_ms * NS_PER_MS)
    bag = record(make(tmp_path / "rack", execution), tmp_path / "bag", operate, slices=40, options=options)
    report, here = compare(monkeypatch, bag)
    assert report.identical
    compare(monkeypatch, bag, {"WORK": OPERATED_WORK.replace("TOTAL * 0.5", "TOTAL * 0.25")})
    compare(monkeypatch, bag, {"LISTEN": LISTEN.replace("1000 THEN", "1001 THEN")}, from_ns=700 * NS_PER_MS)
    assert here.passes == 0
    assert len(here.parts) > 10


@pytest.mark.parametrize("number", [0, 3, 7])
@pytest.mark.parametrize("what", ["cut off", "flipped", "empty", "gone"])
def test_damage_is_told_as_in_one_go(monkeypatch, plain, tmp_path, number, what):
    bag = tmp_path / "bag"
    shutil.copytree(plain, bag)
    file = bag / f"scans_{number}.mcap"
    content = bytearray(file.read_bytes())
    if what == "cut off":
        del content[len(content) // 2 :]
    elif what == "flipped":
        content[len(content) // 2] ^= 0xFF
    elif what == "empty":
        content.clear()
    file.write_bytes(content)
    if what == "gone":
        file.unlink()
        with pytest.raises(BagError, match="AMX6810"):
            prepared(bag)
        return
    try:
        replay = prepared(bag)
    except BagError:
        return  # told before anything is replayed
    assert isinstance(outcome(lambda: replay.run(None)), str)
    compare(monkeypatch, bag)


def reordered(bag, names):
    text = (bag / METADATA_FILE).read_text()
    lines = [f"  - {name}" for name in names]
    head, _, rest = text.partition("relative_file_paths:\n")
    rest = "\n".join(line for line in rest.split("\n") if not line.strip().startswith("- scans_"))
    (bag / METADATA_FILE).write_text(head + "relative_file_paths:\n" + "\n".join(lines) + "\n" + rest)


FILES = [f"scans_{number}.mcap" for number in range(8)]


@pytest.mark.parametrize(
    "names",
    [FILES[1:], FILES[:3] + FILES[4:], FILES[:3] + FILES[5:4:-1], FILES[:2] + FILES[3:1:-1] + FILES[4:], FILES[2:3]],
    ids=["without the first", "one missing", "the last turned round", "two turned round", "one alone"],
)
def test_files_that_are_missing_or_out_of_order_are_told_as_in_one_go(monkeypatch, plain, tmp_path, names):
    bag = tmp_path / "bag"
    shutil.copytree(plain, bag)
    reordered(bag, names)
    assert len(prepared(bag).reader.files) == len(names)
    compare(monkeypatch, bag)


def test_a_recording_without_states_at_its_files_is_done_in_one_go(monkeypatch, plain, tmp_path):
    """Nothing is proven where a file does not tell its beginning."""
    bag = tmp_path / "bag"
    shutil.copytree(plain, bag)
    for number in (3, 4):
        (bag / FILES[number]).unlink()
        changed = rewritten(plain / FILES[number], tmp_path / f"changed{number}", Headless())
        shutil.move(changed / "scans_0.mcap", bag / FILES[number])
    _, here = compare(monkeypatch, bag)
    assert here.passes <= 1


class Headless:
    """Leaves the states at the beginning of a file out."""

    def __init__(self):
        self.begun = False

    def __call__(self, message):
        self.begun = self.begun or type(message).__name__ == "Scan"
        return message if self.begun or type(message).__name__ != "TaskState" else None


@pytest.mark.parametrize("seed", range(6))
def test_any_changed_number_is_told_as_in_one_go(monkeypatch, plain, tmp_path, seed):
    """One number in one message of one file is changed at random: same report, same error, same notes."""
    random_numbers = random.Random(seed)
    number = random_numbers.randrange(8)
    bag = tmp_path / "bag"
    shutil.copytree(plain, bag)
    (bag / FILES[number]).unlink()
    changed = rewritten(plain / FILES[number], tmp_path / "changed", Scrambled(random_numbers))
    shutil.move(changed / "scans_0.mcap", bag / FILES[number])
    compare(monkeypatch, bag)


class Scrambled:
    def __init__(self, random_numbers):
        self._random = random_numbers
        self._left = random_numbers.randrange(60)

    def __call__(self, message):
        self._left -= 1
        names = [name for name, value in zip(message._fields, message, strict=True) if isinstance(value, int)]
        if self._left or not names:
            return message
        name = self._random.choice(names)
        value = getattr(message, name)
        other = not value if isinstance(value, bool) else value ^ (1 << self._random.randrange(6))
        return message._replace(**{name: other})


def test_two_processes_find_the_same(plain):
    replay = prepared(plain)
    shares = []
    found = replay_side_by_side(replay, Workers(2), shares.append)
    assert replay.native == ["SPEED: in Python: native scans are off", "WORK: in Python: native scans are off"]
    assert found == replay.run(None)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    edit = prepared(plain, EDITS["an operand that matters late"])
    assert replay_side_by_side(edit, Workers(2)) == edit.run(None)


def test_a_cluster_finds_the_same_though_a_worker_is_killed(plain, tmp_path):
    pytest.importorskip("distributed", reason="needs automax_ros[cluster]")
    replay = prepared(plain)
    with cluster(tmp_path) as found:
        killed = []

        def kill(_):
            if not killed:
                killed.append(found.workers[0].send_signal(signal.SIGKILL))

        assert replay_side_by_side(replay, Workers(scheduler=found.address), kill) == replay.run(None)
        assert found.workers[0].wait() == -signal.SIGKILL


def faulty(fault):
    """Stands in for ``run_jobs``: one piece has a fault."""

    def pieces(wanted, where, on_done, should_stop):
        for number, piece in enumerate(wanted):
            on_done(JobResult(piece, fault=fault(piece)) if number == 3 else result_of(piece))

    return pieces


def test_files_that_a_worker_cannot_read_are_named_with_the_worker(monkeypatch, plain):
    """Where they can be read here; else the recording is at fault, and the report is that of one job."""
    fault = faulty(lambda piece: JobFault(piece.name, "BagError", "cannot be read", "tcp://10.0.0.2:4000"))
    monkeypatch.setattr(side_by_side, "run_jobs", fault)
    with pytest.raises(BagError, match=r"scans_3\.mcap: cannot be read \(on tcp://10\.0\.0\.2:4000\)") as caught:
        replay_side_by_side(prepared(plain), Workers(scheduler="tcp://10.0.0.1:8786"))
    assert caught.value.code == "AMX6856"


def test_files_whose_workers_die_are_named(monkeypatch, plain):
    fault = faulty(lambda piece: JobFault(piece.name, "WorkerDied", "its process has died", died=True))
    monkeypatch.setattr(side_by_side, "run_jobs", fault)
    with pytest.raises(BagError, match=r"scans_3\.mcap: its process has died") as caught:
        replay_side_by_side(prepared(plain), Workers(2))
    assert caught.value.code == "AMX6855"


def test_small_files_are_put_together(monkeypatch, plain):
    replay = prepared(plain)
    sizes = [file.stat().st_size for file in replay.reader.files]
    monkeypatch.setattr(side_by_side, "LEAST_PART_BYTES", sum(sizes[:3]))
    parts = parts_of(replay)
    assert parts[0] == Part(0, 3)
    assert [part.first for part in parts[1:]] == [part.end for part in parts[:-1]]
    assert parts[-1].end == 8
    monkeypatch.setattr(side_by_side, "LEAST_PART_BYTES", sum(sizes) + 1)
    assert parts_of(replay) == [Part(0, 8)]


def test_one_file_is_one_part(tmp_path):
    assert parts_of(prepared(recorded(tmp_path, seconds=0.2))) == []


def test_a_cluster_that_is_not_used_is_told(monkeypatch, plain):
    """Nobody is at the address: one part is replayed here, as one job does it, and several are not."""
    monkeypatch.setattr(side_by_side, "LEAST_PART_BYTES", 1 << 30)
    replay, notes = prepared(plain), []
    nowhere = Workers(scheduler="tcp://127.0.0.1:1")
    assert replay_side_by_side(replay, nowhere, on_note=notes.append) == replay.run(None)
    assert notes == [side_by_side.ONE_PART]
    assert replay_side_by_side(replay, Workers(2), on_note=notes.append) == replay.run(None)
    assert len(notes) == 1
