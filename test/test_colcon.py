"""What colcon sees of the repository, without colcon; tools/try_colcon.sh builds a workspace with it."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from automax_ros.ros.setup.environment import COLCON_COMMAND

ROOT = Path(__file__).parents[1]
IDENTIFYING = {"package.xml", "setup.py", "CMakeLists.txt", "colcon.pkg"}
"""A folder with one of these files is a package to colcon, which then looks no further below it."""
INTROSPECTION = """
from distutils.core import run_setup

dist = run_setup("setup.py", script_args=("--dry-run",), stop_after="config")
skipped = {"cmdclass", "distclass", "ext_modules", "metadata", *dist.display_option_names}
known = {key: value for key, value in vars(dist).items() if not key.startswith("_") and not callable(value)}
print({key: value for key, value in known.items() if key not in skipped})
"""
"""As colcon asks a package's setup.py what it installs, and what it leaves out."""


def packages_below(folder: Path) -> list[Path]:
    """The packages that colcon finds below a base path: the outermost folders with an identifying file."""
    found = []
    for path, folders, files in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if "COLCON_IGNORE" in files:
            folders.clear()
        elif IDENTIFYING & set(files):
            found.append(Path(path).relative_to(folder))
            folders.clear()
    return found


def python(*arguments, folder=ROOT, **environment):
    """Run this interpreter in a folder, outside of colcon unless the environment says otherwise."""
    clean = {name: value for name, value in os.environ.items() if name not in {"COLCON", "AMENT_PREFIX_PATH"}}
    command = [sys.executable, "-W", "ignore", *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=folder, env={**clean, **environment}
    )


def test_colcon_finds_the_messages_only_where_it_is_told_of_them():
    assert packages_below(ROOT) == packages_below(ROOT / "msg_defs") == [Path()]


def test_the_top_of_the_repository_has_no_links():
    assert [path.name for path in ROOT.iterdir() if path.is_symlink()] == []


def test_page_and_program_name_the_same_command():
    page = (ROOT / "docs" / "howto" / "workspace.md").read_text(encoding="utf-8")
    assert re.search(rf"^{COLCON_COMMAND}(?= )", page, re.MULTILINE)


def test_colcon_can_read_setup_py_and_shares_every_file():
    """It evaluates what is printed as a literal, so no value may be an object of setuptools."""
    result = python("-c", INTROSPECTION)
    assert result.returncode == 0, result.stderr
    known = ast.literal_eval(result.stdout)
    folders = dict(known["data_files"])
    assert folders.pop("share/ament_index/resource_index/packages") == ["resource/automax_ros"]
    assert folders.pop("share/automax_ros") == ["package.xml"]
    assert sorted(path for paths in folders.values() for path in paths) == sorted(
        str(path.relative_to(ROOT))
        for name in ("launch", "config", "examples")
        for path in (ROOT / name).rglob("*")
        if path.is_file() and not {"__pycache__", ".automax"} & set(path.parts)
    )
    for share, paths in folders.items():
        assert {f"share/automax_ros/{Path(path).parent}" for path in paths} == {share}
    for command, option in (("install", "install_scripts"), ("develop", "script_dir")):
        assert known["command_options"][command][option][1] == "$base/lib/automax_ros"


@pytest.fixture
def build_folder(tmp_path):
    """As `colcon build --symlink-install` makes it: setup.py and the package are links."""
    folder = tmp_path / "build"
    folder.mkdir()
    for name in ("setup.py", "automax_ros"):
        (folder / name).symlink_to(ROOT / name)
    return folder


@pytest.fixture
def prefix(tmp_path):
    """Where the messages are installed."""
    prefix = tmp_path / "prefix"
    for kind in ("msg", "srv"):
        shutil.copytree(ROOT / "msg_defs" / kind, prefix / "share" / "automax_msgs" / kind)
    marker = prefix / "share" / "ament_index" / "resource_index" / "packages" / "automax_msgs"
    marker.parent.mkdir(parents=True)
    marker.touch()
    return prefix


def test_a_build_by_colcon_without_messages_stops_with_the_line_to_type(build_folder, tmp_path):
    for path in ({}, {"AMENT_PREFIX_PATH": f"{tmp_path}:"}):
        result = python("setup.py", "egg_info", folder=build_folder, COLCON="1", **path)
        assert result.returncode == 1
        assert f"\n  colcon build --base-paths . {ROOT}/msg_defs\n" in result.stderr
        assert "docs/howto/workspace.md" in result.stderr
        assert "Traceback" not in result.stderr
    assert not list(build_folder.glob("*.egg-info"))


@pytest.mark.parametrize("change", [Path.unlink, lambda path: path.write_text("int32 other\n")], ids=["gone", "other"])
def test_messages_of_another_version_stop_it_too(build_folder, prefix, change):
    """As in a shell that has an older workspace."""
    change(prefix / "share" / "automax_msgs" / "msg" / "Scan.msg")
    result = python("setup.py", "egg_info", folder=build_folder, COLCON="1", AMENT_PREFIX_PATH=str(prefix))
    assert result.returncode == 1
    assert f"{prefix} is of another version (Scan.msg)" in result.stderr


def test_with_the_messages_it_goes_on(build_folder, prefix, tmp_path):
    path = os.pathsep.join(map(str, (tmp_path, prefix)))
    result = python("setup.py", "egg_info", folder=build_folder, COLCON="1", AMENT_PREFIX_PATH=path)
    assert result.returncode == 0, result.stderr
    assert list(build_folder.glob("*.egg-info"))


def test_pip_needs_no_messages(build_folder):
    """They are built after it (`make setup`), or never: the library works without ROS."""
    result = python("setup.py", "egg_info", folder=build_folder)
    assert result.returncode == 0, result.stderr


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("option", [(), ("--symlink-install",)], ids=["copied", "linked"])
def test_colcon_builds_a_workspace_whose_rack_runs(tmp_path_factory, option):
    """From the last commit; the environment with colcon is made once."""
    folder = tmp_path_factory.getbasetemp() / "colcon"
    command = [ROOT / "tools" / "try_colcon.sh", folder, *option]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    # The plain build without messages, the one that was typed, the plain one that the workspace's file tells of them.
    assert re.findall(r"^Summary: (\d) packages? (?:finished|failed)", result.stdout, re.MULTILINE) == ["0", "2", "2"]
    (scans,) = re.findall(r"^  LINE +1 +11 +(\d+) +(\d+) ", result.stdout, re.MULTILINE)
    assert 180 <= sum(map(int, scans)) < 190, result.stdout  # on a busy machine some are late
