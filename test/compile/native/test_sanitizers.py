"""The C code under the address and undefined-behaviour sanitizers: native scans, and replay by columns, hostile too.

The compiler is a script that adds the sanitizers; the tests that exercise the C code run in a child process with it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TESTS = (
    "test/replay/columns",
    "test/compile/base/test_host.py",
    "test/compile/base/test_operations.py",
    "test/replay/drive_report/test_hostile_drives.py",
)
CANARY = "#include <stdlib.h>\nint main(void) { volatile char *a = malloc(4); return a[4]; }\n"
REPORTS = ("AddressSanitizer", "runtime error:")


def sanitizing_compiler(folder: Path) -> Path:
    """A compiler with sanitizers; the test is skipped where there is none."""
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no gcc, whose sanitizers are used")
    script = folder / "sanitizing-gcc"
    flags = "-fsanitize=address,undefined -fno-omit-frame-pointer -g"
    script.write_text(f'#!/bin/sh\necho "$@" >> {folder}/calls\nexec {compiler} {flags} "$@"\n')
    script.chmod(0o755)
    program = folder / "canary"
    command = [str(script), "-x", "c", "-o", str(program), "-"]
    made = subprocess.run(command, input=CANARY, capture_output=True, text=True, check=False)
    if made.returncode:
        pytest.skip(f"this compiler has no sanitizers: {made.stderr[-300:]}")
    assert "AddressSanitizer" in subprocess.run([program], capture_output=True, text=True, check=False).stderr
    return script


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_no_report_of_a_sanitizer(tmp_path):
    script = sanitizing_compiler(tmp_path)
    named = (
        subprocess.check_output([script, f"-print-file-name={name}"], text=True)
        for name in ("libasan.so", "libstdc++.so")
    )
    environment = {
        **os.environ,
        "CC": str(script),
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "LD_PRELOAD": ":".join(name.strip() for name in named),
        "ASAN_OPTIONS": f"detect_leaks=0:log_path={tmp_path}/asan",
        "UBSAN_OPTIONS": f"print_stacktrace=1:log_path={tmp_path}/ubsan",
    }
    (tmp_path / "cache").mkdir(mode=0o700)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--timeout", "1800", *TESTS]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    reports = [path.read_text(errors="replace") for path in sorted(tmp_path.glob("*san.*"))]
    text = "\n".join([*reports, done.stdout[-5000:], done.stderr[-3000:]])
    assert not reports, text
    assert not any(word in text for word in REPORTS), text
    assert done.returncode == 0, text
    calls = (tmp_path / "calls").read_text()
    assert calls.count("-shared") > 10, "the C code was built with the sanitizers"
