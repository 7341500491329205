"""Lines of .NET files, quoted and never interpreted."""

from automax_ros.core.diagnostics import SourceText
from automax_ros.rackfile.old_plants.configuration_task import read_configuration
from automax_ros.rackfile.old_plants.import_ import rack_file_of
from automax_ros.rackfile.old_plants.net_files import net_lines, quoted_for


def test_the_first_line_that_names_a_variable(tmp_path):
    (tmp_path / "A.net").write_text("! NETWORK\nSPEED% 3 40\nSPEED% 4 41\n")
    lines = net_lines(tmp_path).lines
    assert quoted_for("SPEED%", lines) == "; A.net line 2: SPEED% 3 40"
    assert quoted_for("OTHER%", lines) == ""


def test_a_common_of_gbldef_has_its_line_next_to_it(tmp_path):
    (tmp_path / "A.NET").write_text("SPEED% 3 40\n")
    found = read_configuration(SourceText("R.CNF", "10 GBLDEF SPEED%[NETWORK=A]\n20 MEMDEF OTHER%\n"))
    text = rack_file_of(found, "R", tmp_path, {}, (".BLK",)).text
    assert "# GBLDEF, line 1; A.NET line 1: SPEED% 3 40\n" in text
    assert "# MEMDEF, line 2\n" in text


def test_links_out_of_the_folder_and_what_cannot_be_read_are_told(tmp_path):
    folder = tmp_path / "plant"
    (folder / "C.NET").mkdir(parents=True)
    (tmp_path / "SECRET.NET").write_text("SPEED% SECRET\n")
    (folder / "A.NET").symlink_to(tmp_path / "SECRET.NET")
    (folder / "B.NET").write_text("SPEED% 3 40\n")
    found = net_lines(folder)
    assert found.lines["SPEED"] == "B.NET line 1: SPEED% 3 40"
    assert found.left_out == [("A.NET", "is a link out of the folder"), ("C.NET", "is a folder, not a file")]
    text = rack_file_of(read_configuration(SourceText("R.CNF", "10 MEMDEF A%\n")), "R", folder, {}, (".BLK",)).text
    assert text.endswith("# A.NET is a link out of the folder: not read\n# C.NET is a folder, not a file: not read\n")


def test_of_very_many_files_the_first_are_read(tmp_path):
    for number in range(102):
        (tmp_path / f"{number:03}.NET").write_text(f"N{number}% 1\n")
    found = net_lines(tmp_path)
    assert ("N99" in found.lines, "N100" in found.lines) == (True, False)
    assert found.left_out == [("100.NET", "and all after it come after the first 100 .NET files")]
