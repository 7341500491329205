"""A Dask cluster on this machine, for tests: a scheduler and workers in processes of their own."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

TEST = Path(__file__).parents[1]
PATIENCE_S = 240

SCHEDULER = """
import asyncio, sys
from distributed import Scheduler
async def main():
    async with Scheduler(host="127.0.0.1", port=0, dashboard=False) as scheduler:
        print(scheduler.address, flush=True)
        await scheduler.finished()
asyncio.run(main())
"""
WORKER = """
import asyncio, sys
sys.path.append(sys.argv[2])
{before}
from distributed import Worker
async def main():
    async with Worker(sys.argv[1], nthreads=1, dashboard=False, local_directory=sys.argv[3]) as worker:
        print(worker.address, flush=True)
        await worker.finished()
asyncio.run(main())
"""


class Cluster:
    """A scheduler at ``address`` and ``workers``; all ends with ``close``."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._stack = folder, ExitStack()
        self.scheduler, self.address = self._start(SCHEDULER)
        self.workers: list[subprocess.Popen[str]] = []

    def worker(self, before: str = "") -> subprocess.Popen[str]:
        """Start another worker; ``before`` is what it executes before it imports anything of ours."""
        process, _ = self._start(WORKER.format(before=before), self.address, str(TEST), str(self._folder))
        self.workers.append(process)
        return process

    def close(self) -> None:
        self._stack.close()

    def _start(self, program: str, *arguments: str) -> tuple[subprocess.Popen[str], str]:
        process = subprocess.Popen(
            [sys.executable, "-c", program, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=self._folder,
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        assert process.stdout is not None
        self._stack.callback(process.stdout.close)
        address = process.stdout.readline().strip()
        assert address.startswith("tcp://"), "Dask has not begun"
        return process, address


@contextmanager
def cluster(folder: Path, workers: int = 2) -> Iterator[Cluster]:
    """A cluster while the block lasts."""
    found = Cluster(folder)
    try:
        for _ in range(workers):
            found.worker()
        yield found
    finally:
        found.close()
