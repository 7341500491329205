"""`automax new`: a rack file from a folder of tasks, whatever lies in it."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import automax_ros
from automax_ros.cli.main import main
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.old_plants.draft import DraftFault, draft

EXAMPLE = Path(automax_ros.__file__).parent.parent / "config" / "section_drive"
FAST = "10 COMMON REF%, RUN@, GAIN, TABLE%(10), NOTE$:12, TEXT$, GRID!(2,3)\n20 CALL SCAN_LOOP(TICKS=1)\n30 END\n"
SLOW = "10 COMMON REF%, COUNT!\n20 CALL SCAN_LOOP(TICKS=10)\n30 END\n"


@pytest.fixture
def plant(automax):
    """A folder `plant` with two tasks."""
    (automax.folder / "plant").mkdir()
    automax.write("plant/SLOW.BLK", SLOW)
    automax.write("plant/FAST.BLK", FAST)
    return automax


def loaded(path):
    result = load(path)
    assert result.diagnostics == []
    return result.config


def test_rack_file_passes_the_check(plant):
    result = plant("new", "plant")
    assert (result.code, result.err) == (0, "")
    assert result.out == (
        "wrote plant/rack.yaml: 1 Processor, 2 tasks, 8 commons\n"
        "next: automax run plant/rack.yaml --simulated --duration 10\n"
    )
    assert plant("check", "plant/rack.yaml") == (0, "", "")
    assert plant("run", "plant", "--simulated", "--duration", "0.1").code == 0


def test_commons_have_types_dimensions_and_lengths(plant):
    plant("new", "plant")
    config = loaded("plant/rack.yaml")
    assert config.name == "PLANT"
    assert config.modules[0].model == "57C413"
    found = {item.name: (item.dimensions, item.length) for item in config.variables}
    assert found == {
        "REF%": ((), 0), "RUN@": ((), 0), "GAIN": ((), 0), "TABLE%": ((11,), 0), "NOTE$": ((), 12), "TEXT$": ((), 31),
        "GRID!": ((3, 4), 0), "COUNT!": ((), 0),
    }  # fmt: skip


def test_task_that_scans_most_often_is_served_first(plant):
    plant("new", "plant", "--tick-ms", "2.5")
    (processor,) = loaded("plant/rack.yaml").task_modules
    assert (processor.slot, processor.tick_ns) == (1, 2_500_000)
    assert {task.name: task.priority for task in processor.tasks} == {"FAST": 4, "SLOW": 5}


def test_processors_share_the_tasks(plant):
    assert plant("new", "plant", "--processors", "2").code == 0
    tasks = [[task.name for task in item.tasks] for item in loaded("plant/rack.yaml").task_modules]
    assert tasks == [["FAST"], ["SLOW"]]
    assert plant("new", "plant", "--force", "--processors", "4").code == 0
    assert len(loaded("plant/rack.yaml").task_modules) == 4


def test_tasks_of_the_example_give_its_commons(automax):
    (automax.folder / "copy").mkdir()
    for path in EXAMPLE.glob("*.BLK"):
        automax.write(f"copy/{path.name}", path.read_bytes())
    assert automax("new", "copy", "--processors", "2").code == 0
    shape = {item.name: (item.dimensions, item.length) for item in loaded("copy/rack.yaml").variables}
    known = {item.name: (item.dimensions, item.length) for item in load(EXAMPLE / "rack.yaml").config.variables}
    assert shape.items() <= known.items()
    assert len(shape) == 30


def test_conflict_is_told_with_both_places(plant):
    plant.write("plant/TABLES.BLK", "10 COMMON TABLE%(20), NOTE$:8\n20 CALL SCAN_LOOP(TICKS=4)\n30 END\n")
    result = plant("new", "plant")
    assert result.code == 1
    assert (
        "plant/TABLES.BLK:1:11: error[AMX4011]: TABLE% is an array (20) here, an array (10) at plant/FAST.BLK:1:29"
        in result.err
    )
    assert "NOTE$ has the length 8 here, 12 at plant/FAST.BLK:1:41" in result.err
    assert result.err.endswith("correct what is shown above, then run: automax check plant/rack.yaml\n")
    assert Path("plant/rack.yaml").exists()


def test_faulty_task_is_taken_as_far_as_it_can_be_read(plant):
    plant.write("plant/WRONG.BLK", "10 COMMON MORE%\n20 CALL SCAN_LOOP(TICKS=4)\n30 MORE% = NIL%\n40 END\n")
    result = plant("new", "plant")
    assert result.code == 1
    assert "plant/WRONG.BLK:3:12: error[AMX4001]" in result.err
    assert "MORE%" in {item.name for item in loaded("plant/rack.yaml").variables}


def test_nothing_is_written_over_without_force(plant):
    plant.write("plant/rack.yaml", "mine")
    result = plant("new", "plant")
    assert (result.code, result.out) == (2, "")
    assert result.err == ("automax new: error: plant/rack.yaml exists already\n  hint: --force writes over it\n")
    assert Path("plant/rack.yaml").read_text() == "mine"
    assert plant("new", "plant", "--force").code == 0
    assert Path("plant/rack.yaml").read_text().startswith("# Made from")


def test_rack_file_may_stand_above_the_tasks(plant):
    assert plant("new", "plant", "-o", "line.yaml").code == 0
    (processor,) = loaded("line.yaml").task_modules
    assert [str(task.file) for task in processor.tasks] == ["plant/FAST.BLK", "plant/SLOW.BLK"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none"], "none is not a folder"),
        (["plant/FAST.BLK"], "plant/FAST.BLK is not a folder"),
        (["empty"], "empty holds no task (.BLK, .BAS)"),
        (["plant", "-o", "empty/rack.yaml"], "empty is not the folder of the tasks, nor above it"),
        (["plant", "-o", "empty"], "empty is a folder"),
        (["plant", "-o", "plant/FAST.BLK", "--force"], "a rack file ends in .yaml or .yml"),
        (["plant", "-o", "none/rack.yaml"], "none is not the folder of the tasks, nor above it"),
        (["plant", "--tick-ms", "0.3"], "--tick-ms"),
        (["plant", "--processors", "5"], "--processors"),
    ],
)
def test_wrong_usage_writes_nothing(plant, arguments, words):
    (plant.folder / "empty").mkdir()
    before = sorted(plant.folder.rglob("*"))
    result = plant("new", *arguments)
    assert (result.code, result.out) == (2, "")
    assert words in result.err
    assert sorted(plant.folder.rglob("*")) == before


def test_more_tasks_than_the_processors_run(plant):
    for number in range(40):
        plant.write(f"plant/T{number}.BLK", SLOW)
    result = plant("new", "plant")
    assert result.code == 2
    assert "42 tasks are more than the 32 of 1 Processors\n  hint: --processors 2" in result.err
    assert plant("new", "plant", "--processors", "2").code == 0


def test_most_commons_are_published_and_the_rest_closed(plant):
    lines = "".join(f"{10 + n} COMMON V{n}%\n" for n in range(250))
    plant.write("plant/MANY.BLK", f"{lines}900 CALL SCAN_LOOP(TICKS=4)\n910 END\n")
    result = plant("new", "plant")
    assert (result.code, result.err) == (0, "")
    loaded("plant/rack.yaml")


# Hostile folders


def test_odd_names_become_names_of_tasks(plant):
    for name in ("LINE SPEED'S.BLK", "line.blk", "9TH.BLK", "VERYLONGNAME1.BLK", "VERYLONGNAME2.BLK"):
        plant.write(f"plant/{name}", SLOW)
    assert plant("new", "plant").code == 0
    (processor,) = loaded("plant/rack.yaml").task_modules
    assert {task.file.name: task.name for task in processor.tasks} == {
        "FAST.BLK": "FAST", "SLOW.BLK": "SLOW", "LINE SPEED'S.BLK": "LINE_SPE", "line.blk": "LINE", "9TH.BLK": "T9TH",
        "VERYLONGNAME1.BLK": "VERYLONG", "VERYLONGNAME2.BLK": "VERYLON2",
    }  # fmt: skip


def test_a_basic_task_gets_the_least_priority(plant):
    plant.write("plant/WATCH.BAS", "10 START EVERY 1 SECONDS\n20 PRINT 1\n30 END\n")
    assert plant("new", "plant").code == 0
    text = (plant.folder / "plant" / "rack.yaml").read_text()
    assert "WATCH: {file: WATCH.BAS, priority: 6} # a BASIC task" in text
    (processor,) = loaded("plant/rack.yaml").task_modules
    assert {task.file.name for task in processor.tasks} == {"FAST.BLK", "SLOW.BLK", "WATCH.BAS"}


def test_files_that_cannot_be_tasks_are_left_out(plant):
    folder = plant.folder / "plant"
    os.mkfifo(folder / "PIPE.BLK")
    (folder / "FOLDER.BLK").mkdir()
    (folder / "LOOP.BLK").symlink_to("LOOP.BLK")
    plant.write("secret", "10 COMMON SECRET%\n")
    (folder / "OUT.BLK").symlink_to("../secret")
    (folder / "LARGE.BLK").write_bytes(b"1" * 1_000_001)
    (folder / "\x1b[2J\n: {}.BLK").write_text(SLOW)
    (Path(os.fsdecode(os.fsencode(folder) + b"/\xff.BLK"))).write_text(SLOW)
    result = plant("new", "plant")
    assert result.code == 0
    assert result.err.count("left out") == 7
    assert "\x1b" not in result.err
    assert [task.name for task in loaded("plant/rack.yaml").task_modules[0].tasks] == ["FAST", "SLOW"]
    assert "SECRET" not in Path("plant/rack.yaml").read_text()


def test_link_in_place_of_the_rack_file_is_not_written_through(plant):
    plant.write("precious", "mine")
    (plant.folder / "plant" / "rack.yaml").symlink_to("../precious")
    assert plant("new", "plant").code == 2
    assert Path("precious").read_text() == "mine"


def test_rack_file_over_the_limit_is_refused(plant, monkeypatch):
    monkeypatch.setattr("automax_ros.rackfile.old_plants.draft.MAX_BYTES", 500)
    result = plant("new", "plant")
    assert result.code == 2
    assert "would have more than 500 bytes" in result.err
    assert not Path("plant/rack.yaml").exists()


def test_folder_of_too_many_files_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("automax_ros.rackfile.old_plants.draft._MOST_FILES", 3)
    for number in range(4):
        (tmp_path / f"{number}.txt").touch()
    with pytest.raises(DraftFault, match="more than 3 files"):
        draft(tmp_path, tmp_path, 5_500_000)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=300) | st.text(alphabet="10 COMNAR%@$!:(),[]=\n&RE'\"", max_size=200).map(str.encode))
def test_any_text_gives_a_rack_file_that_loads(tmp_path, text):
    (tmp_path / "ANY.BLK").write_bytes(b"10 COMMON A%\n" + text)
    assert main(["new", str(tmp_path), "--force"]) in (0, 1)
    assert load(tmp_path / "rack.yaml").config is not None


UDC_TASK = (
    "10 COMMON REF%, FB%, CUR%, OL@, RUN@, GAIN, WIDE!\n20 CALL SCAN_LOOP(TICKS={})\n"
    "30 CALL LAG(INPUT=REF%, WLG=GAIN, RESET=-RUN@, OUTPUT=CUR%)\n"
    "40 CALL THERMAL_OVERLOAD(I_FDBK=FB%, LIM_BAR=150, OVERLOAD=OL@)\n50 END\n"
)


def test_tasks_with_blocks_of_a_udc_stand_on_one(automax):
    """Nothing says where their commons stand: each gets a place in the dual port that the check accepts."""
    (automax.folder / "plant").mkdir()
    other = UDC_TASK.replace("CUR%", "CUR_B%").replace("OL@", "OL_B@")
    automax.write("plant/WIND_A.BLK", UDC_TASK.format(4))
    automax.write("plant/WIND_B.BLK", other.format(4))
    automax.write("plant/SPEED.BLK", "10 COMMON REF%, RUN@\n20 CALL SCAN_LOOP(TICKS=2)\n30 REF% = 5\n40 END\n")
    result = automax("new", "plant")
    assert (result.code, result.err) == (0, "")
    config = load("plant/rack.yaml").config
    modules = [(item.slot, item.model, [task.name for task in item.tasks]) for item in config.modules]
    assert modules == [(0, "57C413", []), (1, "57C435", ["SPEED"]), (2, "57552", ["WIND_A", "WIND_B"])]
    points = {item.name: item.point for item in config.declared}
    assert {point.slot for point in points.values()} == {2}
    places = [(point.register, point.bit) for point in points.values()]
    assert len(set(places)) == len(places)
    flags = {name: points[name].register for name in ("OL@", "OL_B@", "RUN@")}
    assert flags["OL@"] // 2 == flags["OL_B@"] // 2 != flags["RUN@"] // 2  # a pair of registers goes one way
    checked = automax("check", "plant/rack.yaml")
    assert checked.code == 0
    assert "error[" not in checked.out


def test_tasks_of_other_ticks_have_a_udc_of_their_own(automax):
    (automax.folder / "plant").mkdir()
    other = UDC_TASK.replace("REF%", "R_B%").replace("FB%", "F_B%").replace("CUR%", "CUR_B%").replace("OL@", "OL_B@")
    other = other.replace("RUN@", "RUN_B@").replace("GAIN", "G_B").replace("WIDE!", "W_B!")
    automax.write("plant/WIND_A.BLK", UDC_TASK.format(4))
    automax.write("plant/WIND_B.BLK", other.format(6))
    assert automax("new", "plant", "--processors", "2").code == 0
    modules = load("plant/rack.yaml").config.modules
    assert [(item.slot, [task.name for task in item.tasks]) for item in modules if item.model == "57552"] == [
        (3, ["WIND_A"]), (4, ["WIND_B"])
    ]  # fmt: skip


def test_a_task_that_only_the_user_knows_to_be_a_udcs_stands_on_one(automax):
    """No block of it says so: it turns the common clock on and limits a reference."""
    (automax.folder / "plant").mkdir()
    automax.write("plant/LINE.BLK", "10 COMMON REF%\n20 CALL SCAN_LOOP(TICKS=4)\n30 END\n")
    automax.write("plant/WIND_A.BLK", "10 COMMON REF%, OUT%\n20 CALL SCAN_LOOP(TICKS=4)\n30 OUT% = REF%\n40 END\n")
    assert automax("new", "plant", "--udc", "wind_a").code == 0
    tasks = {task.name: module.model for module, task in load("plant/rack.yaml").config.placed_tasks}
    assert tasks == {"LINE": "57C435", "WIND_A": "57552"}
    result = automax("new", "plant", "--udc", "WIND_B", "--force")
    assert (result.code, "plant holds no task 'WIND_B' for a UDC" in result.err) == (2, True)


def test_a_basic_task_is_none_for_a_udc(automax):
    (automax.folder / "plant").mkdir()
    automax.write("plant/LINE.BLK", "10 COMMON REF%\n20 CALL SCAN_LOOP(TICKS=4)\n30 END\n")
    automax.write("plant/B1.BAS", "10 COMMON REF%\n20 PRINT REF%\n30 END\n")
    result = automax("new", "plant", "--udc", "b1")
    assert result.code == 2
    assert result.err.endswith(
        "B1.BAS is a BASIC task; a UDC runs control-block tasks (.BLK) only\n"
        "  hint: leave out --udc B1: a Processor runs it\n"
    )
    assert not (automax.folder / "plant" / "rack.yaml").exists()
