"""Build a wheel with the modules compiled ahead of time, for this interpreter and this kind of machine.

tools/build_wheel.py [FOLDER]     without FOLDER it is written to dist/. Plain `pip wheel .` makes one of Python only.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

import build_compiled
from compiled_groups import ROOT

sys.path.insert(0, str(ROOT))
from automax_ros.core import compiled


def tag() -> str:
    """Return the tag of the compiled modules: this CPython, on this platform."""
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub(r'[-.]', '_', sysconfig.get_platform())}"


def plain_wheel(folder: Path) -> Path:
    """Build the wheel of Python only, with this environment's setuptools.

    setuptools collects files below ``folder``: an existing build/ may contain modules that were removed since.
    """
    settings = folder / "build.cfg"
    settings.write_text(f"[build]\nbuild_base = {folder / 'build'}\n", encoding="utf-8")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--no-build-isolation", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, env={**os.environ, "DIST_EXTRA_CONFIG": str(settings)})
    return next(folder.glob("*.whl"))


def record_line(name: str, content: bytes) -> str:
    """Return a line of RECORD: path, digest, size (PEP 427)."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}"


def with_compiled(plain: Path, modules: Path, folder: Path) -> Path:
    """Return a copy of a wheel with the files of ``modules`` in it, tagged for this platform."""
    with zipfile.ZipFile(plain) as archive:
        files = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}
    for path in sorted(modules.rglob("*")):
        if path.is_file():
            files[f"{compiled.FOLDER}/{path.relative_to(modules).as_posix()}"] = path.read_bytes()
    facts = next(name for name in files if name.endswith(".dist-info/WHEEL"))
    text = re.sub(r"(?m)^Tag: .*$", f"Tag: {tag()}", files[facts].decode())
    files[facts] = text.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false").encode()
    record = facts.replace("WHEEL", "RECORD")
    del files[record]
    lines = [*(record_line(name, content) for name, content in files.items()), f"{record},,"]
    files[record] = ("\n".join(lines) + "\n").encode()
    target = folder / f"{plain.name.rsplit('-', 3)[0]}-{tag()}.whl"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return target


def main() -> int:
    """Build the wheel; return 1 where nothing could be compiled."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "dist")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="automax_wheel") as temporary:
        modules = Path(temporary) / "modules"
        with contextlib.suppress(FileNotFoundError):  # installed groups are reused where they are up to date
            shutil.copytree(Path(sysconfig.get_path("platlib")) / compiled.FOLDER, modules)
        build_compiled.main(["--folder", str(modules)])
        if not list(modules.glob("*/*")):
            print("error: nothing was compiled; `pip wheel .` makes the wheel of Python alone", file=sys.stderr)
            return 1
        print(with_compiled(plain_wheel(Path(temporary)), modules, folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
