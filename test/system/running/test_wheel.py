"""A wheel with compiled modules, installed where no compiler is: it says that they run, and a rack does."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def done(*command, **changes):
    """Return what a command prints; it must end well."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    ended = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, check=False, env=environment | changes, cwd="/"
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


@pytest.mark.soak
def test_a_wheel_brings_its_compiled_modules_to_a_machine_without_compiler(tmp_path):
    wheel = Path(done(sys.executable, ROOT / "tools" / "build_wheel.py", tmp_path / "dist").splitlines()[-1])
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert wheel.name.split("-")[2:4] == [python, python]
    assert not wheel.name.endswith("any.whl")
    fresh = tmp_path / "fresh"
    done(sys.executable, "-m", "venv", "--without-pip", fresh)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", fresh)
    done(*pip, "install", "--no-index", "--no-deps", "--quiet", wheel)
    site = next(fresh.glob("lib/python*/site-packages"))
    # What the package needs is that of this environment; the package itself is found before it.
    (site / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    automax = fresh / "bin" / "automax"
    said = done(automax, "--version", PATH=str(tmp_path))
    assert [line.split(":")[0] for line in said.splitlines()[1:]] == ["compiled"], said
    program = "from automax_ros.runtime.time import scheduler; print(scheduler.__file__)"
    assert done(fresh / "bin" / "python", "-c", program, PATH=str(tmp_path)).startswith(f"{site}/automax_ros_compiled/")
    run = (automax, "run", ROOT / "config" / "section_drive" / "rack.yaml", "--simulated", "--duration", "2")
    for switch in ("auto", "off"):
        done(*run, "--record", tmp_path / switch, PATH=str(tmp_path), AUTOMAX_COMPILED=switch)
    files = sorted(path.name for path in (tmp_path / "off").iterdir())
    assert "metadata.yaml" in files
    assert all((tmp_path / "auto" / name).read_bytes() == (tmp_path / "off" / name).read_bytes() for name in files)
