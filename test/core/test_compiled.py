"""Modules compiled ahead of time: used while their sources are those that were compiled, and told about."""

import importlib.util
import os
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

import automax_ros
from automax_ros.core import compiled

PACKAGE = Path(automax_ros.__path__[0])
HEAD = "\t".join(("automax_ros compiled", compiled.VERSION, EXTENSION_SUFFIXES[0]))
TEXTS = {"drive/base/motor.py": b"MOTOR = 1\n", "core/types.py": b"TYPE = 1\n"}
LIBRARY = b"no machine code"


@pytest.fixture
def package(tmp_path):
    """A package of two files, of which one was compiled and the other gave it its types."""
    for name, text in TEXTS.items():
        path = tmp_path / "automax_ros" / name
        path.parent.mkdir(parents=True)
        path.write_bytes(text)
    return tmp_path / "automax_ros"


def index(folder, head=HEAD):
    folder.mkdir(exist_ok=True)
    lines = [head, "group\tdrive", f"library\tautomax_drive__mypyc\tdrive-1/library.so\t{len(LIBRARY)}"]
    lines.append(f"module\tautomax_ros.drive.base.motor\tdrive-1/shims.so\t{len(LIBRARY)}")
    lines += [f"source\t{name}\t{compiled.source_digest(text)}" for name, text in TEXTS.items()]
    (folder / compiled.INDEX).write_text("\n".join(lines) + "\n")
    (folder / "drive-1").mkdir(exist_ok=True)
    for library in ("library.so", "shims.so"):
        (folder / "drive-1" / library).write_bytes(LIBRARY)
    return compiled.read_index(str(folder))


def finder(package):
    return compiled.CompiledFinder(index(package.parent / compiled.FOLDER), str(package))


def test_module_and_its_library_come_from_the_folder(package):
    found = finder(package)
    folder = package.parent / compiled.FOLDER / "drive-1"
    assert found.find_spec("automax_ros.drive.base.motor").origin == str(folder / "shims.so")
    assert found.find_spec("automax_drive__mypyc").origin == str(folder / "library.so")


@pytest.mark.parametrize("name", ["automax_ros", "automax_ros.drive", "automax_ros.drive.plant.plant", "numpy", "os"])
def test_other_modules_are_left_to_python(package, name):
    assert finder(package).find_spec(name) is None


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("text", [None, b"", b"MOTOR = 2\n"])
def test_a_source_that_changed_is_what_runs(package, name, text):
    if text is None:
        (package / name).unlink()
    else:
        (package / name).write_bytes(text)
    found = finder(package)
    assert found.find_spec("automax_ros.drive.base.motor") is None
    assert found.find_spec("automax_drive__mypyc") is None
    assert found.groups[0].stale.startswith(name)


@pytest.mark.parametrize("library", ["library.so", "shims.so"])
def test_without_its_libraries_the_python_file_runs(package, library):
    found = finder(package)
    (package.parent / compiled.FOLDER / "drive-1" / library).unlink()
    assert found.find_spec("automax_ros.drive.base.motor") is None
    assert found.groups[0].stale.endswith(f"{library} is missing")


@pytest.mark.parametrize("library", ["library.so", "shims.so"])
def test_a_library_that_was_copied_by_half_is_never_loaded(package, library):
    """It would end the process, and nothing would say why."""
    found = finder(package)
    (package.parent / compiled.FOLDER / "drive-1" / library).write_bytes(LIBRARY[:7])
    assert found.find_spec("automax_ros.drive.base.motor") is None
    assert found.groups[0].stale.endswith(f"{library} has 7 bytes of 15")


def test_with_a_library_that_cannot_be_loaded_the_python_file_runs_and_it_is_told(package, monkeypatch):
    monkeypatch.delitem(sys.modules, "automax_drive__mypyc", raising=False)
    found = finder(package)
    spec = found.find_spec("automax_ros.drive.base.motor")
    motor = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(motor)
    assert (motor.MOTOR, motor.__file__) == (1, str(package / "drive" / "base" / "motor.py"))
    assert found.find_spec("automax_ros.drive.base.motor") is None
    monkeypatch.setattr(sys, "meta_path", [found])
    (told,) = compiled.describe(str(package))
    assert told.startswith("plain Python: drive, for its library cannot be loaded: ")
    assert "library.so" in told or "shims.so" in told


@pytest.mark.parametrize(
    ("interface", "why"),
    [
        ("librt.strings\t{0}\t{1}", ""),
        ("librt.strings\t{0}\t0", ""),
        ("librt.strings\t9{0}\t{1}", "librt.strings has C interface {0}.{1}, not 9{0}.{1}: install the librt"),
        ("librt.strings\t{0}\t9{1}", "librt.strings has C interface {0}.{1}, not {0}.9{1}: install the librt"),
        ("librt\t1\t1", "the C interface of librt cannot be read: "),
        ("librt.gone\t1\t1", "the C interface of librt.gone cannot be read: No module named"),
    ],
)
def test_what_calls_another_version_of_a_c_interface_is_not_loaded(package, interface, why):
    folders = compiled._folders(str(PACKAGE))
    here = [group for folder in folders for group in compiled.read_index(str(folder)) if group.interfaces]
    if not here:
        pytest.skip("nothing was compiled here that calls another module's C")
    group = here[0]
    ((module, (binary, offered)),) = group.interfaces.items()
    assert module == "librt.strings"
    index(package.parent / compiled.FOLDER)
    with (package.parent / compiled.FOLDER / compiled.INDEX).open("a") as file:
        file.write(f"interface\t{interface.format(binary, offered)}\n")
    found = compiled.CompiledFinder(compiled.read_index(str(package.parent / compiled.FOLDER)), str(package))
    assert (found.find_spec("automax_ros.drive.base.motor") is None) == bool(why)
    assert found.groups[0].stale.startswith(why.format(binary, offered))


def test_what_is_told_was_tried(package, monkeypatch):
    monkeypatch.delitem(sys.modules, "automax_drive__mypyc", raising=False)
    monkeypatch.setattr(sys, "meta_path", [finder(package)])
    (told,) = compiled.describe(str(package))
    assert told.startswith("plain Python: drive, for its library cannot be loaded: ")


def test_time_of_a_file_does_not_count(package):
    for name in TEXTS:
        os.utime(package / name, (1, 1))
    assert finder(package).find_spec("automax_ros.drive.base.motor")


@pytest.mark.parametrize("head", ["", "automax_ros compiled\t0\t.so", HEAD.replace(EXTENSION_SUFFIXES[0], ".cp0.so")])
def test_what_another_interpreter_or_version_has_built_is_passed_over(package, head):
    assert index(package.parent / compiled.FOLDER, head) == []


def test_a_damaged_index_is_none(tmp_path):
    assert compiled.read_index(str(tmp_path)) == []
    for content in (b"\xff\xfe\x00", f"{HEAD}\nlibrary\tx\n".encode(), f"{HEAD}\ngroup\tdrive\nmodule\ta".encode()):
        (tmp_path / compiled.INDEX).write_bytes(content)
        assert compiled.read_index(str(tmp_path)) == []


def run(program, switch):
    environment = {**os.environ, compiled.VARIABLE: switch}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment, cwd=PACKAGE.parent
    )
    return done.stdout


def test_switched_off_everything_is_python():
    program = "from automax_ros.drive.base import motor; print(type(motor.Motor.emf).__name__, motor.__file__)"
    kind, file = run(program, "off").split()
    assert (kind, Path(file)) == ("function", PACKAGE / "drive" / "base" / "motor.py")


def test_what_runs_is_told(monkeypatch):
    monkeypatch.setenv(compiled.VARIABLE, "off")
    assert compiled.describe(str(PACKAGE)) == ["plain Python: AUTOMAX_COMPILED=off"]


def test_looking_at_help_reads_no_source():
    """What starts without a compiled module does not pay for the check."""
    program = (
        "import sys; from automax_ros.cli.main import main; main(['--help'])\n"
        "from automax_ros.core.compiled import CompiledFinder\n"
        "print([group.stale for found in sys.meta_path if isinstance(found, CompiledFinder) for group in found.groups])"
    )
    assert set(run(program, "").splitlines()[-1]) <= set("[None, ]")
