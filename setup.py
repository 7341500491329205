"""The part of the build that has to be computed: packages, their data, and the files under share/.

Everything else is in setup.cfg. Messages are never built here: `make setup` compiles msg_defs/ into a virtual
environment, colcon builds it as a package of its own.
"""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "automax_ros"
ROOT = Path(__file__).parent


def package_data() -> list[str]:
    """Every file under automax_ros/ that is not Python: problem pages, tables, example tasks."""
    folder = ROOT / NAME
    files = (path for path in folder.rglob("*") if path.is_file() and path.suffix not in {".py", ".pyc"})
    return sorted(str(path.relative_to(folder)) for path in files)


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """The files of `folder`, one entry a subfolder, to be installed under share/automax_ros/."""
    entries: dict[str, list[str]] = {}
    for path in sorted((ROOT / folder).rglob("*")):
        if path.is_file() and path.suffix != ".pyc":
            relative = path.relative_to(ROOT)
            entries.setdefault(f"share/{NAME}/{relative.parent}", []).append(str(relative))
    return sorted(entries.items())


setup(
    # Here and not in setup.cfg: setuptools would turn it into an object that colcon cannot read.
    python_requires=">=3.10,<3.14",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: package_data()},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared("launch"),
        *shared("config"),
    ],
)
