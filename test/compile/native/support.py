"""What the tests of native code share: C texts of their own, and compilers that misbehave."""

from __future__ import annotations

import os
from pathlib import Path

from automax_ros.compile import native

ABI = (Path(native.__file__).parent / "abi.h").read_text(encoding="utf-8")


def exporting(body: str) -> str:
    """A C text whose scan has this body: ``s`` are the slots of the state, ``l`` what is latched, ``o`` goes out."""
    head = "automax_slot *s, const automax_slot *l, automax_slot *o, automax_host *host"
    unused = "(void)s; (void)l; (void)o; (void)host;"
    return (
        f"{ABI}\n#include <stddef.h>\n"
        f"static int scan({head}) {{ {unused} {body} return AUTOMAX_DONE; }}\n"
        f"int automax_scan({head}) {{ return scan(s, l, o, host); }}\n"
        f"int automax_scan_forced({head}) {{ return scan(s, l, o, host); }}\n"
        f"{COLUMNS}"
    )


COLUMNS = """
static int full(automax_host *host, int64_t line, int64_t code) {
    automax_columns_call *call = *(automax_columns_call **)(host + 1);
    if (call->errors >= call->error_room) return AUTOMAX_FULL;
    call->error_scans[call->errors] = call->done;
    call->error_lines[call->errors] = line;
    call->error_codes[call->errors++] = code;
    return 0;
}
struct with_call { automax_host host; automax_columns_call *call; };
void automax_columns(automax_slot *s, automax_columns_call *call) {
    struct with_call with = {{0}, call};
    automax_slot latched[8], out[8];
    with.host.log = full;
    call->errors = call->written = call->done = 0;
    for (int64_t k = 0; k < call->count; k++) {
        for (int n = 0; call->latched[n] != NULL; n++) latched[n] = call->latched[n][k];
        int64_t errors = call->errors;
        call->ended = scan(s, latched, out, &with.host);
        if (call->errors == call->error_room) call->ended = AUTOMAX_FULL;
        if (call->ended != AUTOMAX_DONE) { call->errors = errors; return; }
        for (int n = 0; call->outputs[n] != NULL; n++) call->outputs[n][k] = out[n];
        call->done++;
    }
}
"""
"""Scans by columns as a translation has them, for at most 8 commons, with errors and without actual memory."""


def compiler_of(folder: Path, script: str) -> Path:
    """A program that can stand for the compiler: it knows --version, and else does what the script says."""
    path = folder / "cc"
    path.write_text(f'#!/bin/sh\n[ "$1" = --version ] && {{ echo fake 1; exit 0; }}\n{script}\n')
    path.chmod(0o755)
    return path


def begun_compiler_of(folder: Path, ending: str = "exec sleep 1000") -> Path:
    """A compiler that tells its process's number through the named pipe ``begun`` of its folder, and goes on and on."""
    (folder / "begun").unlink(missing_ok=True)
    os.mkfifo(folder / "begun")
    return compiler_of(folder, f"echo $$ > {folder / 'begun'}; {ending}")
