"""`automax import FOLDER`: from a floppy's folder to a rack that runs, and what is told on the way."""

from __future__ import annotations

import shutil

import pytest
from rackfile.old_plants.executive.disks import SAMPLE, SCAN, memory, point, processor, rack, task

from automax_ros.rackfile.loader import load

CODES = ("1=57C413B", "3=57C431", "20=57C419", "21=57C403", "22=57C409")
PARTS = [word for code in CODES for word in ("--part", code)]


@pytest.fixture
def floppy(automax):
    shutil.copytree(SAMPLE, automax.folder / "floppy")
    return automax


def test_from_a_floppy_to_a_rack_that_runs(floppy):
    result = floppy("import", "floppy", "--output", "plant/rack.yaml", *PARTS)
    assert result.code == 0, result.err
    assert result.out == (
        "wrote plant/rack.yaml: 3 tasks, 12 commons; the tasks lie next to it\nnext: automax check plant/rack.yaml\n"
    )
    assert sorted(path.name for path in (floppy.folder / "plant").iterdir()) == [
        "LINE.BLK", "SECT1.BLK", "WIND_A.BLK", "rack.yaml"
    ]  # fmt: skip
    checked = floppy("check", "plant/rack.yaml")
    assert (checked.code, checked.out.count("error[")) == (0, 0)
    assert floppy("run", "plant", "--simulated", "--duration", "0.2").code == 0


def test_everything_that_is_not_sure_is_told_with_its_code(floppy):
    result = floppy("import", "floppy")
    for code in ("AMX6791", "AMX6792", "AMX6794", "AMX6795"):
        assert f"warning[{code}]" in result.err
    assert "  hint: read its number on the module: --part 20=NUMBER, or --module 6=NUMBER\n" in result.err
    assert (
        "part codes: --part 1=57C413 --part 2=57C435 --part 3=57C435 --part 10=57C404 --part 40=57552\n" in result.err
    )
    assert result.err.endswith("--output DIR/rack.yaml writes the rack file, with its 3 tasks\n")
    assert result.out.startswith("# Made from the databases of an AutoMax Programming Executive")
    assert result.code == 0
    assert not list(floppy.folder.glob("*.yaml"))


def test_damage_is_told_and_a_lost_record_is_an_error(floppy):
    path = floppy.folder / "floppy" / "AMXLIB" / "MILL" / "WIND1" / "$SWVAR.DBF"
    data = bytearray(path.read_bytes())
    data[4] = 14
    path.write_bytes(data)
    result = floppy("import", "floppy", "-o", "a/rack.yaml", *PARTS)
    assert (
        "$SWVAR.DBF: warning[AMX6790]: the header says 14 records, the file holds 13: is its number wrong?\n"
        in result.err
    )
    assert result.code == 0
    path.write_bytes(data[:-30])
    result = floppy("import", "floppy", "-o", "b/rack.yaml", *PARTS)
    assert (
        "$SWVAR.DBF record 13: error[AMX6789]: the file ends in the middle of a record, after 86 of 115" in result.err
    )
    assert result.code == 1
    assert len(load(floppy.folder / "b" / "rack.yaml").config.declared) == 11


def test_what_is_lost_is_an_error_and_the_rest_is_written(floppy):
    wrong = ("import", "floppy", *PARTS, "--part", "2=57C419")
    result = floppy(*wrong, "-o", "a/rack.yaml")
    assert (
        "$TASKS.DBF record 1: error[AMX6789]: task LINE is lost: it stands in slot 1, and a 57C419 runs no tasks\n"
        in (result.err)
    )
    assert (result.code, result.out.splitlines()[0]) == (
        1, "wrote a/rack.yaml: 2 tasks, 12 commons; the tasks lie next to it"
    )  # fmt: skip
    folder = floppy.folder / "floppy" / "AMXLIB" / "MILL" / "WIND1"
    (folder / "SECT1.BLK").write_bytes(b"")
    assert floppy("import", "floppy", *PARTS).code == 1
    path = folder / "$SWVAR.DBF"
    path.write_bytes(b"PK\x03\x04" + bytes(range(60)) * 60)
    result = floppy("import", "floppy", *PARTS)
    assert result.code == 1
    assert result.err.count("$SWVAR.DBF") == 1


def test_an_unknown_field_is_told_with_its_values(automax):
    files = {"LINE.BLK": SCAN.format("REF%")}
    folder = rack(automax.folder / "PM1", [processor()], [task("LINE")], [memory("REF")], files)
    path = folder / "$SWVAR.DBF"
    path.write_bytes(path.read_bytes().replace(b"REGISTER\0", b"REGISTR?\0").replace(b"DIM1\0", b"RSVD\0"))
    result = automax("import", "PM1")
    assert "$SWVAR.DBF: warning[AMX6793]: field RSVD N(5) is not understood: it is blank throughout\n" in result.err
    assert (
        "warning[AMX6793]: no field is known to be the register of variables\n  hint: if the table has one: --field"
        in result.err
    )


def test_a_rack_of_a_library_of_two(floppy):
    rack(floppy.folder / "floppy" / "AMXLIB" / "MILL" / "PRESS", [processor(0)], [task("LINE", 0)],
         [memory("REF"), point("A", 5, 0)], {"LINE.BLK": SCAN.format("REF%")})  # fmt: skip
    result = floppy("import", "floppy")
    assert result.code == 2
    assert "floppy holds 2 racks: MILL/PRESS, MILL/WIND1\n  hint: --rack MILL/PRESS chooses one" in result.err
    result = floppy("import", "floppy", "--rack", "press", "-o", "press/rack.yaml", "--module", "5=57C419")
    assert result.code == 0, result.err
    assert [(item.slot, item.model) for item in load(floppy.folder / "press" / "rack.yaml").config.modules] == [
        (0, "57C435"), (5, "57C419")
    ]  # fmt: skip
    assert floppy("run", "press", "--simulated", "--duration", "0.1").code == 0


def test_headers_name_nothing_of_the_plant(floppy):
    result = floppy("import", "floppy", "--headers")
    assert (result.code, result.err) == (0, "")
    assert "rack 1: $SWVAR.DBF: 13 records, 1 deleted" in result.out
    assert "WIND1" not in result.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["floppy", "--rack", "WIND9"], "--rack 'WIND9': floppy holds no such rack"),
        (["floppy", "--part", "57C419"], "'57C419' is not a part code and a module"),
        (["floppy", "--part", "5=57C999"], "there is no such module"),
        (["floppy", "--field", "registr=X"], "'registr' is nothing that $SWVAR has"),
        (["floppy", "--drive", "WIND_A=C"], "'WIND_A=C' is not a task and A or B"),
        (["floppy", "--part", "5=57C419", "--part", "05=57C403"], "--part 5 is given twice"),
        (["floppy", "--module", "5=57C419", "--module", "5=57C403"], "--module 5 is given twice"),
        (["floppy", "--drive", "WIND_A=A", "--drive", "wind_a=B"], "--drive WIND_A is given twice"),
        (["floppy", "--field", "register=A", "--field", "SWVAR.register=B"], "--field SWVAR.register is given twice"),
        (["floppy", "--field", "register=A", "--field", "bit=a"], "--field SWVAR.A is given twice"),
        (["floppy", "--headers", "--output", "new/rack.yaml"], "--headers goes without --output"),
        (["floppy", "--headers", "--force"], "--headers goes without --force"),
        (["floppy", "--headers", "--field", "register=A"], "--headers goes without --field"),
        (["floppy", "--headers", "--part", "5=57C419"], "--headers goes without --part"),
        (["floppy", "--headers", "--module", "5=57C419"], "--headers goes without --module"),
        (["floppy", "--headers", "--drive", "WIND_A=A"], "--headers goes without --drive"),
        (["floppy", "--headers", "--executive", "3.8"], "--headers goes without --executive"),
        (["floppy", "--executive", "2.1"], "'2.1' is not a version with databases"),
        (["floppy", "--executive", "new"], "'new' is not a version with databases"),
        (["floppy", "--codepage", "utf-8"], "--codepage"),
        (["floppy", "--output", "floppy/AMXLIB/MILL/WIND1/rack.yaml"], "lies in the old rack's own folder"),
        (["floppy", "--output", "there/rack.yaml"], "there/rack.yaml exists already"),
        (["floppy", "--output", "tasks/rack.yaml"], "tasks/LINE.BLK exists already"),
        (["there"], "there holds no rack of a Programming Executive"),
        (["floppy", "--output", "there/rack.yaml/rack.yaml"], "rack.yaml"),
    ],
)
def test_wrong_usage_writes_nothing(floppy, arguments, message):
    for name in ("there/rack.yaml", "tasks/LINE.BLK"):
        (floppy.folder / name).parent.mkdir()
        (floppy.folder / name).write_text("precious")
    before = sorted(floppy.folder.rglob("*"))
    result = floppy("import", *arguments)
    assert (result.code, message in result.err) == (2, True), result.err
    assert sorted(floppy.folder.rglob("*")) == before


def test_with_force_it_is_written_over(floppy):
    assert floppy("import", "floppy", "-o", "plant/rack.yaml").code == 0
    assert floppy("import", "floppy", "-o", "plant/rack.yaml").code == 2
    assert floppy("import", "floppy", "-o", "plant/rack.yaml", "--force").code == 0
