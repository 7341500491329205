"""Build the modules of compiled_groups.py ahead of time into an installation: `make setup` calls it.

tools/build_compiled.py [--folder FOLDER] [--group NAME]...     without FOLDER: site-packages of this interpreter

Each group is translated to C by mypyc and compiled by the C compiler that Python names (or CC), on all cores. A group
whose sources, compiler and options have not changed since the last build is kept. Without a compiler, or when a group
cannot be built, everything works in plain Python: a line says so, and the exit code is 0.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from compiled_groups import GROUPS, PACKAGE, ROOT, Group
from compiler_parts import parts

sys.path.insert(0, str(ROOT))
from automax_ros.core import compiled

FLAGS = (
    *("-O2", "-ffp-contract=off", "-fno-fast-math", "-fwrapv"),
    *("-fPIC", "-fvisibility=hidden", "-DNDEBUG", "-g0", "-w"),
)
"""None of these changes a result: no fused multiply-add, no reordered sums, integers wrap as in Python's own build.
Hidden functions are called directly, and may be inlined."""
PART_BYTES = 600_000
"""Bytes of C that are compiled at once: headers are read only a few times, modules are inlined in each other, and all
cores have work."""
TOOLS = ("build_compiled.py", "compiled_translate.py", "compiler_parts.py")
NICE = 5


class NotBuiltError(Exception):
    """A group cannot be built here: the text says why."""


@dataclass(frozen=True)
class Compiler:
    """The C compiler and the linker of extension modules as commands, and the version that the compiler prints."""

    compile: tuple[str, ...]
    link: tuple[str, ...]
    version: str


def find_compiler() -> Compiler | None:
    """Return the compiler that Python was built with, or CC of the environment; None if there is none."""
    command = tuple(shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"))
    if not shutil.which(command[0]):
        command = ("gcc",)
    if not shutil.which(command[0]) or find_spec("mypyc") is None or find_spec("setuptools") is None:
        return None
    header = Path(sysconfig.get_path("include")) / "Python.h"
    if not header.is_file():
        return None
    shared = shlex.split(sysconfig.get_config_var("LDSHARED") or "cc -shared")
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False).stdout
    return Compiler((*command, *FLAGS), (*command, *shared[1:]), version.partition("\n")[0])


def digest_of(path: Path) -> str:
    """Return the digest of a source that the loader compares."""
    return compiled.source_digest(path.read_bytes())


def stamp_of(group: Group, compiler: Compiler) -> str:
    """Return a hash of all that a group is made from, except the sources of its types, which are in the index."""
    from mypy.version import __version__

    text = [sys.version, __version__, compiler.version, *compiler.compile, *compiler.link]
    text += [digest_of(ROOT / "tools" / name) for name in TOOLS]
    text += [f"{path.relative_to(PACKAGE)} {digest_of(path)}" for path in group.sources()]
    return hashlib.sha256("\n".join(text).encode()).hexdigest()[:16]


def kept(folder: Path, group: Group, compiler: Compiler) -> list[str] | None:
    """Return the lines of the index for a group that is installed and up to date; None if it is not."""
    facts = folder / f"{group.name}-{stamp_of(group, compiler)}" / compiled.INDEX
    try:
        lines = facts.read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    for line in lines:
        word, _, rest = line.partition("\t")
        if word == "source":
            file, digest = rest.split("\t")
            if not (PACKAGE / file).is_file() or digest_of(PACKAGE / file) != digest:
                return None
    return lines


def run(command: Sequence[str], folder: Path) -> None:
    """Run a compiler; raise ``NotBuiltError`` with its last messages if it fails."""
    done = subprocess.run(["nice", "-n", str(NICE), *command], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()
        raise NotBuiltError(" / ".join(said[-3:]) or f"{command[0]} ended with {done.returncode}")


def translated(group: Group, work: Path) -> dict[str, Any]:
    """Translate a group in a separate process; return the facts that it writes."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "compiled_translate.py"), group.name, str(work)],
        cwd=ROOT, capture_output=True, text=True, check=False, env={**os.environ, compiled.VARIABLE: "off"},
    )  # fmt: skip
    if done.returncode:
        said = [line for line in (done.stderr + done.stdout).strip().splitlines() if "warning:" not in line]
        raise NotBuiltError(" / ".join(said[-3:]))
    facts: dict[str, Any] = json.loads((work / "facts.json").read_text(encoding="utf-8"))
    return facts


def build(group: Group, compiler: Compiler, folder: Path, pool: ThreadPoolExecutor) -> list[str]:
    """Build a group into ``folder``; return its lines of the index."""
    name = f"{group.name}-{stamp_of(group, compiler)}"
    digests = {path: digest_of(path) for path in PACKAGE.rglob("*.py")}
    with tempfile.TemporaryDirectory(prefix="automax_compiled") as temporary:
        work = Path(temporary)
        facts = translated(group, work)
        folders = [work, *(work / item for item in facts["include"]), sysconfig.get_path("include")]
        include = [f"-I{item}" for item in folders]
        library_parts = part_files(work, [*facts["c"], *facts["runtime"]])
        objects = [*library_parts, *facts["shims"].values()]
        list(pool.map(lambda file: run([*compiler.compile, *include, "-c", file, "-o", f"{file}.o"], work), objects))
        suffix = EXTENSION_SUFFIXES[0]
        library = f"{facts['library']}{suffix}"
        run([*compiler.link, *(f"{file}.o" for file in library_parts), "-o", library], work)
        for file in facts["shims"].values():
            run([*compiler.link, f"{file}.o", "-o", f"{file[:-2]}{suffix}"], work)
        lines = [f"group\t{group.name}", f"library\t{facts['library']}\t{placed(work, name, library)}"]
        for module in sorted(facts["modules"]):
            shim = facts["shims"][module.rpartition(".")[0]]
            lines.append(f"module\t{module}\t{placed(work, name, f'{shim[:-2]}{suffix}')}")
        lines += [f"interface\t{item}\t{abi}\t{api}" for item, (abi, api) in sorted(facts["interfaces"].items())]
        sources = sorted([*facts["modules"].values(), *facts["needs"].values()])
        lines += [
            f"source\t{Path(file).relative_to(PACKAGE.name).as_posix()}\t{digests[ROOT / file]}" for file in sources
        ]
        target = folder / name
        shutil.rmtree(target, ignore_errors=True)
        target.mkdir(parents=True)
        for path in work.glob(f"*{suffix}"):
            shutil.copy(path, target)
        (target / compiled.INDEX).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return lines


def part_files(work: Path, files: Sequence[str]) -> list[str]:
    """Write files that include about PART_BYTES of C each, in the order of ``files``; return their names."""
    divided = parts([work / file for file in files], PART_BYTES)
    for number, part in enumerate(divided):
        text = "".join(f'#include "{path.relative_to(work)}"\n' for path in part)
        (work / f"part_{number}.c").write_text(text, encoding="utf-8")
    return [f"part_{number}.c" for number in range(len(divided))]


def placed(work: Path, folder: str, file: str) -> str:
    """Return the future place of a library and its size in bytes, as written in the index."""
    return f"{folder}/{file}\t{(work / file).stat().st_size}"


def write_index(folder: Path, lines: list[str]) -> None:
    """Replace the index atomically, so that a program that starts meanwhile finds either the old groups or the new."""
    head = ["\t".join(("automax_ros compiled", compiled.VERSION, EXTENSION_SUFFIXES[0]))]
    temporary = folder / f"{compiled.INDEX}.new"
    temporary.write_text("\n".join([*head, *lines]) + "\n", encoding="utf-8")
    os.replace(temporary, folder / compiled.INDEX)
    used = {line.split("\t")[2].partition("/")[0] for line in lines if line.startswith("library")}
    for path in folder.iterdir():
        if path.is_dir() and path.name not in used:
            shutil.rmtree(path, ignore_errors=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the groups that have changed; return 0 also where nothing can be built."""
    parser = argparse.ArgumentParser(description="Build modules ahead of time; see the head of this file.")
    parser.add_argument("--folder", type=Path, default=Path(sysconfig.get_path("platlib")) / compiled.FOLDER)
    parser.add_argument("--group", action="append", choices=[group.name for group in GROUPS])
    chosen = parser.parse_args(arguments)
    compiler = find_compiler()
    if compiler is None:
        print("no C compiler, Python.h or mypyc: the package runs in plain Python, which does the same, slower")
        return 0
    chosen.folder.mkdir(parents=True, exist_ok=True)
    groups = [group for group in GROUPS if not chosen.group or group.name in chosen.group]
    made: dict[str, list[str]] = {}
    began = time.monotonic()
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool, ThreadPoolExecutor(os.cpu_count() or 1) as outer:
        jobs = {}
        for group in groups:
            found = kept(chosen.folder, group, compiler)
            if found is None:
                print(f"compiling {len(group.sources())} modules of {group.name} ahead of time ...", flush=True)
                jobs[group.name] = outer.submit(build, group, compiler, chosen.folder, pool)
            else:
                made[group.name] = found
        for name, job in jobs.items():
            try:
                made[name] = job.result()
            except NotBuiltError as error:
                print(f"{name} stays plain Python: {error}")
    write_index(chosen.folder, [line for group in groups for line in made.get(group.name, ())])
    if jobs:
        print(f"compiled ahead of time in {time.monotonic() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
