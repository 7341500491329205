"""Finds the modules of this package that were compiled ahead of time, checks that they are fresh, and loads them.

The Python files are the reference and always exist. Machine code made from them (by mypyc, `make setup`) is in a folder
``automax_ros_compiled`` of the installation, next to the package or in the site-packages of this interpreter; no other
place is searched. A group of modules is used only if every source that it was made from, and every source that its
types came from, still has the same content (decision): a file that was edited runs as it is. If libraries are
missing, cannot be loaded on this machine, or call another module's C in a version that is not there, the Python files
run too; ``automax --version`` says why. ``AUTOMAX_COMPILED=off`` in the environment switches all of it off.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, ModuleSpec, SourceFileLoader
from types import ModuleType

FOLDER = "automax_ros_compiled"
INDEX = "index.txt"
VERSION = "3"
VARIABLE = "AUTOMAX_COMPILED"
OFF = ("off", "0", "no", "false")


class CompiledGroup:
    """Modules that are loaded together: ``libraries`` by name of module, ``sources`` with digests of their content.

    ``sizes`` has the bytes of each library: a truncated one would end the process when it is loaded. ``interfaces`` has
    the version of the C interface of other modules that the libraries call: the binary one, and the lowest feature
    version. ``stale`` is empty while the group may be used, otherwise the reason why not; None before the first of its
    modules is requested.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.modules: list[str] = []
        self.libraries: dict[str, str] = {}
        self.sizes: dict[str, int] = {}
        self.sources: dict[str, str] = {}
        self.interfaces: dict[str, tuple[int, int]] = {}
        self.stale: str | None = None

    def fresh(self, package: str) -> bool:
        """Return whether the sources below the folder ``package`` are those that were compiled; checked once."""
        if self.stale is None:
            harmed = (_explain_damage(file, size) for file, size in self.sizes.items())
            changed = (_explain_change(package, file, digest) for file, digest in self.sources.items())
            others = (_differing(module, *version) for module, version in self.interfaces.items())
            self.stale = next((why for reasons in (harmed, changed, others) for why in reasons if why), "")
        return not self.stale

    def loads(self) -> bool:
        """Return whether this machine loads the library that the modules of a fresh group share."""
        for name in self.libraries:
            if name not in self.modules and not self.stale:
                try:
                    __import__(name)
                except ImportError as error:
                    self.refuse(error)
        return not self.stale

    def refuse(self, error: ImportError) -> None:
        """Record that the library cannot be loaded."""
        self.stale = f"its library cannot be loaded: {error}"

    @property
    def has_begun(self) -> bool:
        """Whether the library that its modules share is loaded: all of them are machine code from then on, or none."""
        return any(name in sys.modules for name in self.libraries if name not in self.modules)


class CompiledLoader(ExtensionFileLoader):
    """Loads a module of a group; if the machine cannot load the group's first one, the Python file (decision)."""

    def __init__(self, name: str, file: str, group: CompiledGroup, source: str) -> None:
        super().__init__(name, file)
        self.group, self.source = group, source

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module, or None if the Python file is to be used."""
        try:
            return super().create_module(spec)
        except ImportError as error:
            if self.group.has_begun or spec.name not in self.group.modules:
                raise
            self.group.refuse(error)
            spec.loader, spec.origin = SourceFileLoader(spec.name, self.source), self.source
            return None  # type: ignore[return-value]


class CompiledFinder:
    """Finds compiled modules, before Python searches for the files (``sys.meta_path``)."""

    def __init__(self, groups: Sequence[CompiledGroup], package: str) -> None:
        self.groups = tuple(groups)
        self.package = package
        self._groups = {name: group for group in groups for name in group.libraries}

    def find_spec(self, fullname: str, *_: object) -> ModuleSpec | None:
        """Return the location of a module's machine code; None if there is none, or none that is fresh."""
        group = self._groups.get(fullname)
        if group is None or not group.fresh(self.package):
            return None
        file = group.libraries[fullname]
        source = os.path.join(self.package, *fullname.split(".")[1:]) + ".py"
        spec = ModuleSpec(fullname, CompiledLoader(fullname, file, group, source), origin=file)
        spec.has_location = True
        return spec


def source_digest(content: bytes) -> str:
    """Return a short digest of a source, as in .pyc files that are checked by content."""
    from importlib.util import source_hash

    return source_hash(content).hex()


def switched_off() -> bool:
    """Return whether the environment selects plain Python."""
    return os.environ.get(VARIABLE, "").strip().lower() in OFF


def install(package: str) -> None:
    """Install the finder of compiled modules, if there are any for the package in the folder ``package``."""
    if switched_off():
        return
    for folder in _folders(package):
        groups = read_index(folder)
        if groups:
            sys.meta_path.insert(0, CompiledFinder(groups, package))
            return


def read_index(folder: str) -> list[CompiledGroup]:
    """Return the groups in a folder for this interpreter; none if the folder is missing or has another form."""
    try:
        with open(os.path.join(folder, INDEX), encoding="utf-8") as file:
            lines = [line.rstrip("\n").split("\t") for line in file]
    except (OSError, UnicodeDecodeError):
        return []
    if lines[:1] != [["automax_ros compiled", VERSION, EXTENSION_SUFFIXES[0]]]:
        return []
    try:
        return _groups(folder, lines[1:])
    except (IndexError, ValueError):
        return []  # it is truncated


def _groups(folder: str, lines: Sequence[list[str]]) -> list[CompiledGroup]:
    groups: list[CompiledGroup] = []
    for line in lines:
        if line[0] == "group":
            groups.append(CompiledGroup(line[1]))
        elif line[0] in ("library", "module"):
            if line[0] == "module":
                groups[-1].modules.append(line[1])
            file = os.path.join(folder, line[2])
            groups[-1].libraries[line[1]] = file
            groups[-1].sizes[file] = int(line[3])
        elif line[0] == "source":
            groups[-1].sources[line[1]] = line[2]
        elif line[0] == "interface":
            groups[-1].interfaces[line[1]] = (int(line[2]), int(line[3]))
    return groups


def describe(package: str) -> list[str]:
    """Describe the code that runs: one line, and one for each group that is not used, with the reason."""
    if switched_off():
        return [f"plain Python: {VARIABLE}={os.environ[VARIABLE]}"]
    finder = next((finder for finder in sys.meta_path if isinstance(finder, CompiledFinder)), None)
    if finder is None:
        return ["plain Python: nothing was compiled ahead of time for this interpreter"]
    used = [group for group in finder.groups if group.fresh(package) and group.loads()]
    count = sum(len(group.modules) for group in used)
    lines = [f"compiled: {count} modules ({', '.join(group.name for group in used)})"] if used else []
    return lines + [f"plain Python: {group.name}, for {group.stale}" for group in finder.groups if group not in used]


def _folders(package: str) -> tuple[str, ...]:
    """Return the places of the installation: next to the package (a wheel), or the interpreter's site-packages."""
    import sysconfig

    return (
        os.path.join(os.path.dirname(package), FOLDER),
        os.path.join(sysconfig.get_path("platlib"), FOLDER),
    )


def _explain_damage(file: str, size: int) -> str:
    try:
        found = os.path.getsize(file)
    except OSError:
        return f"{file} is missing"
    return "" if found == size else f"{file} has {found} bytes of {size}"


def _explain_change(package: str, file: str, digest: str) -> str:
    try:
        with open(os.path.join(package, file), "rb") as source:
            content = source.read()
    except OSError:
        return f"{file} cannot be read"
    return "" if source_digest(content) == digest else f"{file} has changed since"


def _differing(module: str, binary: int, offered: int) -> str:
    """Return why machine code cannot call a module's C interface, of which it needs this version; empty if it can."""
    import ctypes

    try:
        capsule = __import__(module, fromlist=["_C_API"])._C_API
        pointer = ctypes.pythonapi.PyCapsule_GetPointer
        pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
        table = ctypes.cast(pointer(capsule, f"{module}._C_API".encode()), ctypes.POINTER(ctypes.c_void_p))
        version_getter = ctypes.CFUNCTYPE(ctypes.c_int)
        found, offers = version_getter(table[0])(), version_getter(table[1])()
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        return f"the C interface of {module} cannot be read: {error}"
    if found == binary and offers >= offered:
        return ""
    return f"{module} has C interface {found}.{offers}, not {binary}.{offered}: install the librt it was compiled with"
