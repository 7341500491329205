"""What a person sees: a line that is rewritten on a terminal, plain lines elsewhere."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
from collections.abc import Callable

import pytest

from system.support import COMMAND, PATIENCE_S, ROOT, TYPES, automax, catches

COLUMNS = 60
REDRAW = "\r\x1b[K"


def on_terminal(until: Callable[[str, float], bool], **environment: str) -> str:
    """Run the rack in simulated time on a terminal of 60 columns, then Ctrl-C; return all that was shown.

    ``until`` is asked with the text so far, and for how many seconds the program has been ready for Ctrl-C.
    """
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
    surroundings = {key: value for key, value in os.environ.items() if key not in {"COLUMNS", "LINES", "NO_COLOR"}}
    command = [*COMMAND, "run", str(TYPES), "--simulated", "--watch", "REF%,NOTE$,COUNT!,GRID%(1,2)"]
    process = subprocess.Popen(
        command, stdin=slave, stdout=slave, stderr=slave, cwd=ROOT, env={**surroundings, **environment}
    )
    os.close(slave)
    text, asked = "", False
    ready: float | None = None
    deadline = time.monotonic() + PATIENCE_S
    try:
        while time.monotonic() < deadline:
            if select.select([master], [], [], 0.1)[0]:
                try:
                    text += os.read(master, 65536).decode()
                except OSError:  # the other end is closed
                    break
            if ready is None and catches(process.pid, signal.SIGTERM):
                ready = time.monotonic()
            if not asked and ready is not None and until(text, time.monotonic() - ready):
                asked = True
                process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()
        os.close(master)
    return text


@pytest.mark.parametrize("colour", [{}, {"NO_COLOR": "1"}], ids=["colour", "no colour"])
def test_terminal_line_is_rewritten_and_fits(colour):
    text = on_terminal(lambda text, _: text.count(REDRAW) >= 3, TERM="xterm", **colour)
    drawn, summary = text.rsplit(REDRAW, 1)
    lines = drawn.split(REDRAW)[1:]
    assert len(lines) >= 3
    for line in lines:
        assert re.match(r" *\d+\.\d s  \d+ scans/s  \d+x  REF%=1000", line)
        assert len(line) < COLUMNS
        assert "\n" not in line
    assert summary.startswith("ran ")
    assert "REF%=1000  NOTE$=ready  COUNT!=" in summary
    assert "GRID%(1,2)=6" in summary
    assert "\x1b" not in summary


def test_dumb_terminal_gets_no_control_sequences():
    text = on_terminal(lambda text, _: " scans/s " in text, TERM="dumb")
    assert "\x1b" not in text
    assert "ran " in text


def test_pipe_gets_plain_text():
    ended = automax("run", TYPES, "--simulated", "--duration", "1")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("ran 1.000 s in ")
    assert not re.search(r"[\x1b\r]", ended.out)


def test_closed_pipe_ends_quietly():
    with subprocess.Popen(
        [*COMMAND, "run", str(TYPES), "--simulated", "--duration", "1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
    ) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == b""
        assert process.wait(PATIENCE_S) == 141
