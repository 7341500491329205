"""Lets every command that reads recordings read hostile ones, in a process whose memory and time are limited.

Arguments: a sound recording, a folder for work, how many mutants, the seed. Prints a JSON list: what was done, command,
exit code (or the exception that came out), seconds; at last the greatest memory in MB.
"""

from __future__ import annotations

import contextlib
import io
import json
import resource
import shutil
import signal
import sys
import time
import traceback
from pathlib import Path

from automax_ros.cli.main import main
from recordings.mutations import mutants

PATIENCE_S = 30
"""Most processor time of a command: a busy host takes none of it."""
ADDRESS_SPACE = 1_500_000_000
COMMANDS = (
    ("export", "{bag}", "--output", "{work}/out.csv"),
    ("bag", "repair", "{bag}", "--json"),
    ("bag", "info", "{bag}"),
    ("replay", "{bag}"),
)


def outcome(words: list[str]) -> object:
    """Exit code of a command, or what came out of it."""
    signal.setitimer(signal.ITIMER_PROF, PATIENCE_S)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            return main(words)
    except BaseException:  # whatever comes out is what the test wants to know
        return traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def timed_out(*_: object) -> None:
    raise TimeoutError(f"not done within {PATIENCE_S} s of processor time")


def most_memory_mb() -> float:
    """Return the most memory that this program has taken; getrusage would tell that of the process it was made from."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1000


if __name__ == "__main__":
    sound, work, count, seed = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    signal.signal(signal.SIGPROF, timed_out)
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    results = []
    bag = work / "bag"
    for name, data, text in mutants(sound, count, seed):
        bag.mkdir()
        (bag / "scans_0.mcap").write_bytes(data)
        (bag / "metadata.yaml").write_bytes(text)
        for command in COMMANDS:
            began = time.monotonic()
            words = [word.format(bag=bag, work=work) for word in command]
            results.append((name, command[0:2], outcome(words), time.monotonic() - began))
        for folder in work.iterdir():
            shutil.rmtree(folder) if folder.is_dir() else folder.unlink()
    print(json.dumps([results, most_memory_mb()]))
