"""Code generation for a ROS interface package without CMake: the steps of rosidl_generate_interfaces().

.msg -> .idl (rosidl_adapter) -> .json with type descriptions and hashes -> C structs, type supports, Python classes.
The generators are those of the distribution, from PyPI; nothing is computed here.
"""

import contextlib
import copy
import io
import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

# rclpy loads the C type support, which finds that of its middleware by name at run time.
TYPE_SUPPORTS = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]
PYTHON_TYPE_SUPPORT = "rosidl_typesupport_c"
# Folder and suffix of each kind of interface.
KINDS = ("msg", "srv")


@dataclass(frozen=True)
class Interfaces:
    """One interface package: its sources, the folder for its code, and the prefix of ROS 2."""

    name: str
    folder: Path  # holds package.xml, msg/ and srv/
    output: Path
    prefix: Path
    dependencies: tuple[str, ...]  # interface packages whose types it uses

    @property
    def definitions(self) -> list[Path]:
        """The .msg and .srv files, absolute, sorted by kind and name."""
        return sorted(path for kind in KINDS for path in self.folder.resolve().glob(f"{kind}/*.{kind}"))

    @property
    def share(self) -> Path:
        """The folder to be installed as share/NAME: definitions in three forms."""
        return self.output / "share"

    def code(self, generator: str) -> Path:
        """Return the folder of one generator's files; a compiler finds headers in its parent as NAME/msg/..."""
        return self.output / generator / self.name


def generate(package: Interfaces) -> None:
    """Write the code of all generators under `package.output`, on all cores."""
    _parse_once()
    _write_share(package)
    generators = [_generate_c, _generate_fastrtps, _generate_introspection, _generate_dispatch, _generate_python]
    # Forked: each process has the parsed trees.
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        for job in [pool.submit(_quietly, generator, package) for generator in generators]:
            job.result()


def _parse_once() -> None:
    """Make the generators share the trees of the .idl files: parsing takes each longer than its own work.

    Must be called before a generator is imported, since they import the parser's function by name.
    """
    from rosidl_parser import parser

    if hasattr(parser.parse_idl_file, "trees"):
        return
    parse = parser.parse_idl_file
    trees: dict[Path, Any] = {}

    def parse_idl_file(locator: Any, png_file: str | None = None) -> Any:
        path = locator.get_absolute_path()
        if path not in trees:
            trees[path] = parse(locator, png_file)
        return copy.deepcopy(trees[path])

    parse_idl_file.trees = trees  # type: ignore[attr-defined]
    parser.parse_idl_file = parse_idl_file


def _write_share(package: Interfaces) -> None:
    """Write the definitions, their .idl form, and the .json type descriptions, from which the hashes are computed."""
    from rosidl_adapter import convert_to_idl
    from rosidl_generator_type_description import generate_type_hash

    for definition in package.definitions:
        kind = definition.parent.name
        target = package.share / kind
        target.mkdir(parents=True, exist_ok=True)
        (target / definition.name).write_bytes(definition.read_bytes())
        with contextlib.redirect_stdout(io.StringIO()):
            convert_to_idl(package.share.resolve(), package.name, Path(kind) / definition.name, package.share.resolve())
    generate_type_hash(str(_arguments(package, "rosidl_generator_type_description", package.share)))


def _quietly(generator: Callable[[Interfaces], None], package: Interfaces) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        generator(package)


def _generate_c(package: Interfaces) -> None:
    from rosidl_generator_c import generate_c

    generate_c(str(_arguments(package, "rosidl_generator_c")))


def _generate_fastrtps(package: Interfaces) -> None:
    from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c

    generate_typesupport_fastrtps_c(str(_arguments(package, "rosidl_typesupport_fastrtps_c")))


def _generate_introspection(package: Interfaces) -> None:
    from rosidl_typesupport_introspection_c import generate_c

    generate_c(str(_arguments(package, "rosidl_typesupport_introspection_c")))


def _generate_dispatch(package: Interfaces) -> None:
    from rosidl_typesupport_c import generate_c

    generate_c(str(_arguments(package, "rosidl_typesupport_c")), TYPE_SUPPORTS)


def _generate_python(package: Interfaces) -> None:
    from rosidl_generator_py import generate_py

    generate_py(str(_arguments(package, "rosidl_generator_py")), [PYTHON_TYPE_SUPPORT])
    (package.code("rosidl_generator_py") / "__init__.py").touch()


def _arguments(package: Interfaces, generator: str, output: Path | None = None) -> Path:
    """Write the argument file that CMake would write for a generator; return its path."""
    output = output or package.code(generator)
    share = package.prefix / "share"
    templates = share / generator / "resource"
    stems = [f"{path.parent.name}/{path.stem}" for path in package.definitions]
    arguments = {
        "package_name": package.name,
        "idl_tuples": [f"{package.share}:{stem}.idl" for stem in stems],
        "output_dir": str(output),
        "template_dir": str(templates),
        "target_dependencies": [],
        "include_paths": [f"{name}:{share / name}" for name in package.dependencies],
        "ros_interface_files": [str(path) for path in package.definitions],
    }
    if generator != "rosidl_generator_type_description":
        arguments["type_description_tuples"] = [f"{stem}.idl:{package.share / stem}.json" for stem in stems]
    for kind in KINDS:
        (output / kind).mkdir(parents=True, exist_ok=True)
    _write_visibility_header(package.name, templates, output)
    path = package.output / f"{generator}.json"
    path.write_text(json.dumps(arguments, indent=2))
    return path


def _write_visibility_header(name: str, templates: Path, output: Path) -> None:
    """Write the header with a library's export macros: a template with two placeholders, filled in as by CMake."""
    for template in templates.glob("*__visibility_control.h.in"):
        text = template.read_text().replace("@PROJECT_NAME_UPPER@", name.upper()).replace("@PROJECT_NAME@", name)
        (output / "msg" / template.stem).write_text(text)
