"""Translate one group of modules to C by mypyc, in a separate process, since mypyc has global state.

tools/compiled_translate.py GROUP FOLDER     writes C into FOLDER, and FOLDER/facts.json
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

# setuptools first: mypyc checks whether it is imported.
import setuptools  # type: ignore[import-untyped]  # noqa: F401
from compiled_groups import GROUPS, ROOT
from mypy.fscache import FileSystemCache
from mypyc.build import construct_groups, get_mypy_config, include_dir
from mypyc.codegen import emitmodule
from mypyc.common import RUNTIME_C_FILES, shared_lib_name
from mypyc.errors import Errors
from mypyc.namegen import exported_name
from mypyc.options import CompilerOptions

CONFIG = """[mypy]
ignore_missing_imports = True
python_version = 3.{minor}
cache_dir = {cache}
"""
SHIM = """
PyMODINIT_FUNC PyInit_{last}(void)
{{
    PyObject *library = PyImport_ImportModule("{library}");
    if (!library) return NULL;
    PyObject *capsule = PyObject_GetAttrString(library, "init_{exported}");
    Py_DECREF(library);
    if (!capsule) return NULL;
    PyObject *(*begin)(void) = (PyObject *(*)(void))PyCapsule_GetPointer(capsule, "{library}.init_{exported}");
    Py_DECREF(capsule);
    return begin ? begin() : NULL;
}}
"""
"""The function that Python calls to load a module: it gets the module from the group's library. Each package has one
file of these."""


def translate(name: str, folder: Path) -> dict[str, Any]:
    """Write the C files of a group; return its modules, the others they were checked against, and its C files."""
    group = next(group for group in GROUPS if group.name == name)
    paths = [str(path.relative_to(ROOT)) for path in group.sources()]
    config = folder / "mypy.ini"
    config.write_text(CONFIG.format(minor=sys.version_info.minor, cache=folder / "cache"), encoding="utf-8")
    wanted = CompilerOptions(multi_file=True, target_dir=str(folder), group_name=f"automax_{name}")
    files = FileSystemCache()
    sources, every, options = get_mypy_config([f"--config-file={config}", *paths], None, wanted, files)
    groups = construct_groups(sources, False, True, wanted.group_name)
    result = emitmodule.parse_and_typecheck(every, options, wanted, groups, files)
    errors = Errors(options)
    try:
        if not result.errors:
            translated, texts, _ = emitmodule.compile_modules_to_c(result, wanted, errors, groups)
    finally:
        result.manager.metastore.close()
    problems = [*result.errors, *(message for message in errors.new_messages() if ": error:" in message)]
    if problems:
        raise SystemExit("\n".join(problems))
    for file, text in texts[0]:
        (folder / file).write_text(text, encoding="utf-8")
    modules = {source.module: str(source.path) for source in sources}
    used = sorted(emitmodule.collect_source_dependencies(translated), key=lambda item: item.path)
    return {
        "modules": modules,
        "needs": needs(result, set(modules)),
        "library": shared_lib_name(f"automax_{name}"),
        "c": [file for file, _ in texts[0] if file.endswith(".c")],
        "runtime": runtime(folder, [item.path for item in used]),
        "include": sorted({item for source in used for item in source.include_dirs}),
        "interfaces": interfaces([item.path for item in used]),
        "shims": shims(shared_lib_name(f"automax_{name}"), modules, folder),
    }


def needs(result: Any, modules: set[str]) -> dict[str, str]:
    """Return the other modules of the package that the group was checked against: their types are compiled in."""
    found: dict[str, str] = {}
    for module in modules:
        for other in result.graph[module].dependencies:
            if other.split(".")[0] == "automax_ros" and other not in modules and other in result.graph:
                found[other] = str(Path(result.graph[other].path).resolve().relative_to(ROOT))
    return found


def runtime(folder: Path, used: list[str]) -> list[str]:
    """Copy mypyc's own C files next to the group's; return those that all need, and those that the group ``used``."""
    here = Path(include_dir())
    for path in here.rglob("*.[ch]"):
        target = folder / path.relative_to(here)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    return [*RUNTIME_C_FILES, *used]


def interfaces(used: list[str]) -> dict[str, list[int]]:
    """Return the C interfaces of librt that a group ``used``, each with its ABI and API versions of mypyc's headers."""
    found: dict[str, list[int]] = {}
    for folder in {Path(file).parent for file in used}:
        header = Path(include_dir()) / folder / f"librt_{folder.name}.h"
        if header.is_file():
            defined = re.findall(r"#define LIBRT_\w+_(ABI|API)_VERSION (\d+)", header.read_text(encoding="utf-8"))
            versions = {kind: int(number) for kind, number in defined}
            found[f"librt.{folder.name}"] = [versions["ABI"], versions["API"]]
    return found


def shims(library: str, modules: dict[str, str], folder: Path) -> dict[str, str]:
    """Write the functions that Python calls, one file per package of the group; return the file of each package."""
    written: dict[str, str] = {}
    for package in sorted({module.rpartition(".")[0] for module in modules}):
        text = "#include <Python.h>\n" + "".join(
            SHIM.format(last=module.rpartition(".")[2], library=library, exported=exported_name(module))
            for module in sorted(modules)
            if module.rpartition(".")[0] == package
        )
        written[package] = f"shims_{package.replace('.', '_')}.c"
        (folder / written[package]).write_text(text, encoding="utf-8")
    return written


if __name__ == "__main__":
    target = Path(sys.argv[2])
    (target / "facts.json").write_text(json.dumps(translate(sys.argv[1], target)), encoding="utf-8")
