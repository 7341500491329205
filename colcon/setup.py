"""The package automax_ros as colcon builds it: what setup.cfg says, and the files that ROS looks for in share/.

colcon takes no package from a folder below another package: with a package.xml or setup.py in the repository's own
folder a plain `colcon build` would not see msg_defs/. So they stand here, next to links to what they install
(decision).
"""

from pathlib import Path

from setuptools import setup

NAME = "automax_ros"


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """The files of `folder`, one entry a subfolder, to be installed under share/automax_ros/."""
    entries: dict[str, list[str]] = {}
    for path in sorted(Path(folder).rglob("*")):
        if path.is_file() and path.suffix != ".pyc":
            entries.setdefault(f"share/{NAME}/{path.parent}", []).append(str(path))
    return sorted(entries.items())


setup(
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared("launch"),
        *shared("config"),
        *shared("examples"),
    ],
)
