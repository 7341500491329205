"""Builds automax_msgs into the virtual environment that runs it: .venv/bin/python tools/build_messages.py.

`make setup` uses it in place of colcon, without an installed ROS 2: the generators and libraries come from PyPI wheels,
gcc and g++ from the system. It installs lib/libautomax_msgs__*.so, the Python package automax_msgs, share/automax_msgs
with definitions and type hashes, and the entries of the ament index. A stamp with a hash of everything that the result
depends on is written last, so an interrupted build is repeated and a finished one is not.
"""

import hashlib
import json
import shutil
import sys
import sysconfig
import tempfile
import time
from importlib import metadata
from pathlib import Path

from message_code import Interfaces, generate
from message_libraries import BuildError, build_libraries, check_tools

NAME = "automax_msgs"
TOOLS = Path(__file__).resolve().parent
SOURCE = TOOLS.parent / "msg_defs"
PREFIX = Path(sys.prefix)
STAMP = PREFIX / "share" / NAME / "build.json"
# Interface packages whose types ours use; the same as in CMakeLists.txt.
DEPENDENCIES = ("builtin_interfaces", "service_msgs")
RUN_DEPENDENCIES = ("builtin_interfaces", "rosidl_default_runtime", "service_msgs")


def main() -> int:
    """Build if something changed; return 0 if the messages are up to date, 1 with a line on stderr if not possible."""
    try:
        fingerprint = source_fingerprint()
        if is_current(fingerprint):
            return 0
        check_tools()
        started = time.monotonic()
        print(f"building {NAME} ...", flush=True)
        build(fingerprint)
        print(f"built {NAME} in {time.monotonic() - started:.1f} s")
    except BuildError as error:
        print(f"error: {NAME}: {error}", file=sys.stderr)
        return 1
    return 0


def source_fingerprint() -> str:
    """Return a hash of the definitions, these tools, the interpreter and the versions of the ROS packages.

    Raises:
        BuildError: no generators are installed here.
    """
    digest = hashlib.sha256()
    definitions = [SOURCE / "package.xml", *SOURCE.glob("msg/*.msg"), *SOURCE.glob("srv/*.srv")]
    tools = [
        TOOLS / name for name in ("build_messages.py", "compiler_parts.py", "message_code.py", "message_libraries.py")
    ]
    for path in sorted([*definitions, *tools]):
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)} ".encode() + content)
    # pip may be installing other packages: an incomplete one has no name.
    versions = sorted(
        f"{name} {distribution.version}"
        for distribution in metadata.distributions()
        if (name := distribution.metadata["Name"] or "").startswith(("ros-", "numpy"))
    )
    if not any(version.startswith("ros-rosidl-generator-py ") for version in versions):
        raise BuildError(f"no ROS 2 wheels in {PREFIX}: run `make setup` and start this with .venv/bin/python")
    digest.update(f"{sys.version} {PREFIX} {versions}".encode())
    return digest.hexdigest()


def is_current(fingerprint: str) -> bool:
    """Return whether a finished build of exactly these sources is installed with all its files."""
    try:
        stamp = json.loads(STAMP.read_text())
    except (OSError, ValueError):
        return False
    return stamp["fingerprint"] == fingerprint and all((PREFIX / name).exists() for name in stamp["files"])


def build(fingerprint: str) -> None:
    """Generate, compile, install, and stamp."""
    STAMP.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix=f"{NAME}_") as folder:
        package = Interfaces(NAME, SOURCE, Path(folder), PREFIX, DEPENDENCIES)
        generate(package)
        build_libraries(package)
        files = install(package)
    STAMP.write_text(json.dumps({"fingerprint": fingerprint, "files": files}, indent=1))


def install(package: Interfaces) -> list[str]:
    """Copy the results into the prefix and remove leftovers of earlier builds; return their paths below it."""
    shutil.copyfile(package.folder / "package.xml", package.share / "package.xml")
    site_packages = Path(sysconfig.get_path("platlib"))
    files = replace_folder(package.share, PREFIX / "share" / NAME)
    files += replace_folder(package.code("rosidl_generator_py"), site_packages / NAME)
    files += [replace_file(path, PREFIX / "lib" / path.name) for path in sorted((package.output / "lib").iterdir())]
    return [str(path.relative_to(PREFIX)) for path in files + write_index(package)]


def replace_folder(source: Path, target: Path) -> list[Path]:
    """Replace the folder `target` by the files of `source` that are needed at run time."""
    wanted = [
        path
        for path in sorted(source.rglob("*"))
        if path.suffix in {".py", ".so", ".msg", ".srv", ".idl", ".json", ".xml"}
    ]
    shutil.rmtree(target, ignore_errors=True)
    return [replace_file(path, target / path.relative_to(source)) for path in wanted]


def replace_file(source: Path, target: Path) -> Path:
    """Copy a file so that a process that has the old one mapped keeps its copy."""
    target.parent.mkdir(parents=True, exist_ok=True)
    new = target.with_name(f".{target.name}.new")
    shutil.copyfile(source, new)
    new.replace(target)
    return target


def write_index(package: Interfaces) -> list[Path]:
    """Write the entries of the ament index by which ROS 2 programs find the package and its interfaces."""
    stems = [(path.parent.name, path.stem) for path in package.definitions]
    interfaces = [f"{kind}/{stem}.{suffix}" for kind, stem in stems for suffix in ("idl", "json", kind)]
    entries = {
        "packages": "",
        "rosidl_interfaces": "\n".join(interfaces),
        "package_run_dependencies": ";".join(RUN_DEPENDENCIES),
    }
    index = PREFIX / "share" / "ament_index" / "resource_index"
    for kind, content in entries.items():
        (index / kind).mkdir(parents=True, exist_ok=True)
        (index / kind / NAME).write_text(content)
    return [index / kind / NAME for kind in entries]


if __name__ == "__main__":
    sys.exit(main())
