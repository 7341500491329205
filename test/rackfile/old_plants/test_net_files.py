"""Lines of .NET files, quoted and never interpreted."""

from automax_ros.core.diagnostics import SourceText
from automax_ros.rackfile.old_plants.configuration_task import read_configuration
from automax_ros.rackfile.old_plants.import_ import rack_file_of
from automax_ros.rackfile.old_plants.net_files import net_lines, quoted_for


def test_the_first_line_that_names_a_variable(tmp_path):
    (tmp_path / "A.net").write_text("! NETWORK\nSPEED% 3 40\nSPEED% 4 41\n")
    lines = net_lines(tmp_path)
    assert quoted_for("SPEED%", lines) == "; A.net line 2: SPEED% 3 40"
    assert quoted_for("OTHER%", lines) == ""


def test_a_common_of_gbldef_has_its_line_next_to_it(tmp_path):
    (tmp_path / "A.NET").write_text("SPEED% 3 40\n")
    found = read_configuration(SourceText("R.CNF", "10 GBLDEF SPEED%[NETWORK=A]\n20 MEMDEF OTHER%\n"))
    text = rack_file_of(found, "R", tmp_path, {}, (".BLK",)).text
    assert "# GBLDEF, line 1; A.NET line 1: SPEED% 3 40\n" in text
    assert "# MEMDEF, line 2\n" in text
