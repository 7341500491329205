"""Racks in folders: a library of several, parts of one, names in any case, and what is not one."""

from __future__ import annotations

import shutil

import pytest

from automax_ros.rackfile.old_plants.executive import folders
from automax_ros.rackfile.old_plants.executive.folders import FolderFault, chosen_rack, racks_in
from rackfile.old_plants.executive.disks import SAMPLE, processor, rack, task


@pytest.fixture
def library(tmp_path):
    """Two systems: MILL with WIND1 and WIND2, STEEL with WIND1."""
    shutil.copytree(SAMPLE / "AMXLIB", tmp_path / "AMXLIB")
    rack(tmp_path / "AMXLIB" / "MILL" / "WIND2", [processor()], [task("A")])
    rack(tmp_path / "AMXLIB" / "STEEL" / "WIND1", [processor()], [task("A")])
    shutil.copy(SAMPLE / "AMXLIB" / "MILL" / "$RACK.DBF", tmp_path / "AMXLIB" / "STEEL" / "$rack.dbf")
    return tmp_path / "AMXLIB"


def test_all_racks_of_a_library(library):
    assert [item.title for item in racks_in(library)] == ["MILL/WIND1", "MILL/WIND2", "STEEL/WIND1"]
    assert [item.title for item in racks_in(library.parent)] == ["MILL/WIND1", "MILL/WIND2", "STEEL/WIND1"]
    assert [item.title for item in racks_in(library / "MILL")] == ["MILL/WIND1", "MILL/WIND2"]
    assert [item.title for item in racks_in(library / "MILL" / "WIND2")] == ["MILL/WIND2"]


@pytest.mark.parametrize(
    ("name", "title"), [("WIND2", "MILL/WIND2"), ("steel/wind1", "STEEL/WIND1"), ("MILL/WIND1", "MILL/WIND1")]
)
def test_a_rack_is_chosen_by_its_name(library, name, title):
    assert chosen_rack(library, name).title == title


@pytest.mark.parametrize(
    ("name", "message", "hint"),
    [
        (None, "holds 3 racks: MILL/WIND1, MILL/WIND2, STEEL/WIND1", "--rack MILL/WIND1 chooses one"),
        ("WIND1", "holds 2 racks of that name: MILL/WIND1, STEEL/WIND1", "--rack MILL/WIND1"),
        ("WIND3", "holds no such rack", "did you mean WIND2?"),
        ("ZZZ", "holds no such rack", "there are MILL/WIND1, MILL/WIND2, STEEL/WIND1"),
    ],
)
def test_what_chooses_no_rack_is_told(library, name, message, hint):
    with pytest.raises(FolderFault) as caught:
        chosen_rack(library, name)
    assert (message in caught.value.message, hint in caught.value.hint) == (True, True), str(caught.value)


def test_a_rack_alone_has_no_system(tmp_path):
    place = chosen_rack(rack(tmp_path / "pm1"), None)
    assert (place.title, place.system) == ("PM1", None)


def test_names_in_lower_case_are_the_same_files(library):
    folder = library / "MILL" / "WIND2"
    for path in list(folder.iterdir()):
        path.rename(folder / path.name.lower())
    assert chosen_rack(folder, None).rack.table("CARD") == folder / "$card.dbf"


def test_a_folder_without_a_rack_says_what_it_has_instead(tmp_path):
    with pytest.raises(FolderFault, match="holds no rack") as caught:
        chosen_rack(tmp_path, None)
    assert "$CARD.DBF" in caught.value.hint
    (tmp_path / "OLD.CNF").write_text("10 END\n")
    with pytest.raises(FolderFault) as caught:
        chosen_rack(tmp_path, None)
    assert "automax import FILE.CNF" in caught.value.hint


def test_links_are_not_followed_and_very_many_files_are_refused(tmp_path, monkeypatch):
    rack(tmp_path / "real" / "PM1")
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy" / "PM1").symlink_to(tmp_path / "real" / "PM1")
    assert racks_in(tmp_path / "copy") == []
    monkeypatch.setattr(folders, "_MOST_ENTRIES", 2)
    with pytest.raises(FolderFault, match="hold more than 2 files"):
        racks_in(tmp_path / "real")


def test_a_folder_above_that_cannot_be_read_is_no_fault_of_the_rack(library, monkeypatch):
    """The disk's folder is given, not the one above it."""

    def listing(folder):
        if folder == library / "MILL":
            raise PermissionError(13, "Permission denied")
        return real(folder)

    real = folders.os.scandir
    monkeypatch.setattr(folders.os, "scandir", listing)
    place = chosen_rack(library / "MILL" / "WIND1", None)
    assert (place.title, place.system) == ("WIND1", None)


def test_each_folder_is_listed_once(library, monkeypatch):
    listed = []
    real = folders.os.scandir
    monkeypatch.setattr(folders.os, "scandir", lambda folder: listed.append(folder) or real(folder))
    racks_in(library)
    assert len(listed) == len(set(listed)) == 7
