"""What colcon sees of the repository, without colcon; tools/try_colcon.sh builds a workspace with it."""

import glob
import os
import re
import subprocess
from configparser import ConfigParser
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COLCON = ROOT / "colcon"
LINKS = {"LICENSE", "automax_ros", "config", "examples", "launch"}
"""What colcon/ shows of the repository's own folder."""
IDENTIFYING = {"package.xml", "setup.py", "CMakeLists.txt", "colcon.pkg"}
"""A folder with one of these files is a package to colcon, which then looks no further below it."""


def options(path: Path) -> ConfigParser:
    parser = ConfigParser()
    parser.read(path, encoding="utf-8")
    return parser


def packages_below(folder: Path) -> list[Path]:
    """The packages that a plain `colcon build` finds: the outermost folders with an identifying file."""
    found = []
    for path, folders, files in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if "COLCON_IGNORE" in files:
            folders.clear()
        elif IDENTIFYING & set(files):
            found.append(Path(path).relative_to(folder))
            folders.clear()
    return found


def test_a_plain_build_finds_both_packages():
    assert packages_below(ROOT) == [Path("colcon"), Path("msg_defs")]


def test_links_of_the_package_lead_to_the_repository():
    links = {path.name: os.readlink(path) for path in COLCON.iterdir() if path.is_symlink()}
    assert links == {name: f"../{name}" for name in LINKS}


def test_colcon_and_pip_install_the_same_package():
    ours, pips = options(COLCON / "setup.cfg"), options(ROOT / "setup.cfg")
    for section, keys in {
        "metadata": ("name", "version", "description", "license"),
        "options": ("packages",),
        "options.packages.find": ("include",),
        "options.package_data": ("automax_ros",),
        "options.exclude_package_data": ("automax_ros",),
        "options.entry_points": ("console_scripts",),
    }.items():
        assert {key: ours[section][key] for key in keys} == {key: pips[section][key] for key in keys}
    assert "python_requires" not in ours["options"]  # colcon cannot read what setuptools makes of it


def test_pip_shares_every_file_that_colcon_does():
    """setup.cfg names each folder; colcon/setup.py takes all below launch/, config/ and examples/."""
    folders = options(ROOT / "setup.cfg")["options.data_files"]
    shared = {path for pattern in folders.values() for path in glob.glob(pattern, root_dir=ROOT)}
    wanted = {
        str(path.relative_to(ROOT))
        for name in ("launch", "config", "examples")
        for path in (ROOT / name).rglob("*")
        if path.is_file() and not {"__pycache__", ".automax"} & set(path.parts)
    }
    assert {path for path in shared if (ROOT / path).is_file()} == {
        *wanted, "colcon/package.xml", "colcon/resource/automax_ros",
    }  # fmt: skip
    for share, pattern in folders.items():
        if share.startswith("share/automax_ros/"):
            assert share == f"share/automax_ros/{Path(pattern).parent}"


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("option", [(), ("--symlink-install",)], ids=["copied", "linked"])
def test_colcon_builds_a_workspace_whose_rack_runs(tmp_path_factory, option):
    """From the last commit; the environment with colcon is made once."""
    folder = tmp_path_factory.getbasetemp() / "colcon"
    command = [ROOT / "tools" / "try_colcon.sh", folder, *option]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "2 packages finished" in result.stdout
    (scans,) = re.findall(r"^  LINE +1 +11 +(\d+) +(\d+) ", result.stdout, re.MULTILINE)
    assert 180 <= sum(map(int, scans)) < 190, result.stdout  # on a busy machine some are late
