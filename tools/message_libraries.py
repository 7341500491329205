"""Compiles and links the generated code of an interface package: five shared libraries and one Python extension."""

import os
import shlex
import shutil
import subprocess
import sysconfig
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from compiler_parts import parts
from message_code import KINDS, PYTHON_TYPE_SUPPORT, Interfaces


class BuildError(Exception):
    """The messages cannot be compiled; the text says what to do about it."""


@dataclass(frozen=True)
class Library:
    """One shared library of the package."""

    generator: str  # the generator whose output is compiled
    sources: tuple[str, ...]  # globs below that output
    uses: tuple[str, ...]  # the package's own libraries, by suffix
    ros: tuple[str, ...]  # ROS libraries
    extension: bool = False  # a Python extension module rather than a library
    alone: str = ""  # sources that cannot be compiled with others: their names of file scope collide


@dataclass(frozen=True)
class Unit:
    """The sources of one library that one call of the compiler compiles, one after the other."""

    text: Path
    object: Path


def _each(pattern: str) -> tuple[str, ...]:
    return tuple(f"{kind}/{pattern}" for kind in KINDS)


# In the order of linking: each is linked against those before it.
LIBRARIES = {
    "rosidl_generator_c": Library(
        "rosidl_generator_c", _each("detail/*.c"), (), ("rosidl_runtime_c", "rcutils"), alone="__description.c"
    ),
    "rosidl_typesupport_c": Library(
        "rosidl_typesupport_c", _each("*.cpp"), ("rosidl_generator_c",), ("rosidl_typesupport_c", "rosidl_runtime_c")
    ),
    "rosidl_typesupport_introspection_c": Library(
        "rosidl_typesupport_introspection_c",
        _each("detail/*.c"),
        ("rosidl_generator_c",),
        ("rosidl_typesupport_introspection_c", "rosidl_runtime_c"),
    ),
    "rosidl_typesupport_fastrtps_c": Library(
        "rosidl_typesupport_fastrtps_c",
        _each("detail/*.cpp"),
        ("rosidl_generator_c",),
        ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_fastrtps_cpp", "rosidl_runtime_c", "rmw", "fastcdr"),
    ),
    "rosidl_generator_py": Library(
        "rosidl_generator_py", _each("*.c"), ("rosidl_generator_c", "rosidl_typesupport_c"), ("rosidl_runtime_c",)
    ),
    "extension": Library(
        "rosidl_generator_py",
        ("_*_s.ep.*.c",),
        ("rosidl_generator_c", "rosidl_typesupport_c", "rosidl_generator_py"),
        ("rosidl_typesupport_c", "rosidl_runtime_c"),
        extension=True,
    ),
}

# Small enough that two or more cores share the work.
PART_BYTES = 250_000
COMPILERS = {".c": ("CC", "gcc", "-std=gnu11"), ".cpp": ("CXX", "g++", "-std=c++17")}


def build_libraries(package: Interfaces) -> list[Path]:
    """Compile everything on all cores, then link; return the libraries and the extension.

    Raises:
        BuildError: a compiler or Python's headers are missing, or the compiler reports an error.
    """
    check_tools()
    units = {suffix: _units(package, suffix, library) for suffix, library in LIBRARIES.items()}
    flags = _include_flags(package)
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        for job in [pool.submit(_compile, unit, flags) for each in units.values() for unit in each]:
            job.result()
    return [_link(package, suffix, library, units[suffix]) for suffix, library in LIBRARIES.items()]


def check_tools() -> None:
    """Raise a BuildError with the command that installs it if a compiler or Python.h is missing."""
    missing = [command[0] for command in map(_compiler, COMPILERS) if shutil.which(command[0]) is None]
    if missing:
        raise BuildError(
            f"{' and '.join(missing)} not found: install a C and C++ compiler "
            "(Debian, Ubuntu: sudo apt install gcc g++; Fedora: sudo dnf install gcc gcc-c++)"
        )
    headers = Path(sysconfig.get_path("include"))
    if not (headers / "Python.h").exists():
        version = sysconfig.get_python_version()
        raise BuildError(
            f"{headers}/Python.h not found: install the headers of Python "
            f"(Debian, Ubuntu: sudo apt install python{version}-dev; Fedora: sudo dnf install python3-devel)"
        )


def _compiler(suffix: str) -> list[str]:
    variable, default, _ = COMPILERS[suffix]
    return shlex.split(os.environ.get(variable) or default)


def _sources(package: Interfaces, library: Library) -> list[Path]:
    folder = package.code(library.generator)
    sources = sorted(path for pattern in library.sources for path in folder.glob(pattern))
    if not sources:
        raise BuildError(f"{library.generator} wrote no {' or '.join(library.sources)} for {package.name}")
    return sources


def _include_flags(package: Interfaces) -> list[str]:
    import numpy as np

    generated = [package.output / library.generator for library in LIBRARIES.values()]
    include = package.prefix / "include"
    # ROS packages keep their headers in include/NAME/NAME, Fast CDR in include/fastcdr.
    ros = [include, *sorted(path for path in include.iterdir() if path.is_dir())]
    # -isystem for headers that are not ours: they give no warnings.
    own = [f"-I{path}" for path in dict.fromkeys(generated)]
    foreign = [*ros, Path(np.get_include()), Path(sysconfig.get_path("include"))]
    return own + [f"-isystem{path}" for path in foreign]


def _units(package: Interfaces, suffix: str, library: Library) -> list[Unit]:
    """Divide a library's sources into units, so that headers are read a few times, not a hundred times."""
    folder = package.output / "objects" / suffix
    folder.mkdir(parents=True, exist_ok=True)
    sources = _sources(package, library)
    alone = [source for source in sources if library.alone and source.name.endswith(library.alone)]
    units = [Unit(source, folder / f"{source.parent.parent.name}__{source.name}.o") for source in alone]
    for number, part in enumerate(parts([source for source in sources if source not in alone], PART_BYTES)):
        text = folder / f"part_{number}{part[0].suffix}"
        text.write_text("".join(f'#include "{source.resolve()}"\n' for source in part))
        units.append(Unit(text, text.with_suffix(".o")))
    return units


def _compile(unit: Unit, flags: list[str]) -> None:
    standard = COMPILERS[unit.text.suffix][2]
    # -O1: the messages are a few dozen bytes each; -O2 gains nothing measurable and takes twice as long.
    command = [*_compiler(unit.text.suffix), standard, "-O1", "-fPIC", "-w", *flags]
    _run([*command, "-c", str(unit.text), "-o", str(unit.object)])


def _link(package: Interfaces, suffix: str, library: Library, units: Sequence[Unit]) -> Path:
    libraries = package.output / "lib"
    libraries.mkdir(exist_ok=True)
    if library.extension:
        target = package.code(library.generator) / f"{package.name}_s__{PYTHON_TYPE_SUPPORT}.so"
        dependencies: list[str] = []
    else:
        target = libraries / f"lib{package.name}__{suffix}.so"
        dependencies = [f"{name}__{suffix}" for name in package.dependencies]
    objects = [str(unit.object) for unit in units]
    needed = [*(f"{package.name}__{own}" for own in library.uses), *dependencies, *library.ros]
    folders = [f"-L{libraries}", f"-L{package.prefix / 'lib'}", *_search_at_link_time(package.prefix)]
    names = [f"-l{name}" for name in needed]
    _run([*_compiler(".cpp"), "-shared", *objects, *folders, *names, _run_path(library), "-o", str(target)])
    return target


def _run_path(library: Library) -> str:
    """Return the run path, relative to the file, for finding the other libraries without LD_LIBRARY_PATH."""
    # An extension is in lib/pythonX.Y/site-packages/NAME, the libraries in lib.
    return "-Wl,-rpath,$ORIGIN/../../.." if library.extension else "-Wl,-rpath,$ORIGIN"


def _search_at_link_time(prefix: Path) -> list[str]:
    """Return options for libraries that only our dependencies need; wheels have some in site-packages/*.libs."""
    site_packages = Path(sysconfig.get_path("platlib"))
    return [f"-Wl,-rpath-link,{path}" for path in (prefix / "lib", *sorted(site_packages.glob("ros_*.libs")))]


def _run(command: list[str]) -> None:
    # The compiler is a program of the system: it must not load the wheels' libraries.
    environment = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    result = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if result.returncode:
        raise BuildError(f"{shlex.join(command)}\n{result.stderr.strip()}")
