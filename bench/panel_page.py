"""What the panel's page takes in a browser: the first drawing, an update, memory with trends open. Never fails.

`bench/panel_page.py [MINUTES]` watches memory that long (default 1). It needs Chromium and Playwright, as the tests do.
"""

from __future__ import annotations

import re
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
BAG = ("panel", ROOT / "bags" / "section_drive", "--port", "0")
RACK = ("run", ROOT / "config" / "section_drive", "--panel", "--port", "0")
DRAWINGS, UPDATES, LOOKS = 10, 200, 12
TRENDS = (
    "trends?names=SPEED_FDBK%25,SECT_REF%25,SHAFT_SPEED%25;CUR_REF%25,ARM_CUR%25;TACH%25,ARM_VOLTS%25,LINE_REF%25;RUN@"
)
MEASURES = """name => performance.getEntriesByName(name).map((entry) => entry.duration)"""


@contextmanager
def served(words: tuple[object, ...]) -> Iterator[str]:
    """Run a program with a panel and give the address that it prints."""
    command = [sys.executable, "-m", "automax_ros.cli.main", *map(str, words)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = (re.search(r"http://\S+", line) for line in process.stdout)
        yield next(match[0] for match in found if match is not None)
        process.terminate()


def drawings(page: Any) -> list[float]:
    """Return the time from a click on SPEED to its drawing, ms; the page measures it itself."""
    for _ in range(DRAWINGS):
        for task in ("LINE", "SPEED"):
            page.evaluate("task => { location.hash = `diagram?task=${task}` }", task)
            page.locator(f".view-diagram nav a[aria-current=page]:text-is('{task}')").wait_for()
            page.wait_for_timeout(200)
    return [float(each) for each in page.evaluate(MEASURES, "diagram")[2::2]]


def updates(page: Any) -> list[float]:
    """Return how long the page takes for news, ms: all wires of SPEED of a rack that runs."""
    found: list[float] = []
    for _ in range(UPDATES):
        page.wait_for_timeout(50)
        found += page.evaluate(MEASURES, "update")
    return found


def heap(page: Any, minutes: float) -> list[float]:
    """Return the memory in use after a collection, MB, at equal times."""
    session = page.context.new_cdp_session(page)
    found = []
    for _ in range(LOOKS):
        time.sleep(minutes * 60 / LOOKS)
        session.send("HeapProfiler.collectGarbage")
        found.append(session.send("Runtime.getHeapUsage")["usedSize"] / 1e6)
    return found


def main() -> None:
    """Print the figures."""
    from playwright.sync_api import sync_playwright

    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        print("no Chromium is installed: apt-get install chromium")
        return
    with sync_playwright() as playwright:
        page = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"]).new_page()
        with served(BAG) as address:
            began = time.monotonic()
            page.goto(address)
            page.evaluate("location.hash = 'diagram?task=SPEED'")
            page.locator(".view-diagram g.box").first.wait_for()
            print(f"  SPEED.BLK, from the page's first byte to the drawing  {time.monotonic() - began:8.2f} s")
            took = drawings(page)
            print(f"  from a click to the drawing  median {statistics.median(took):6.1f}  most {max(took):6.1f} ms")
        with served(RACK) as address:
            page.goto(address)
            page.evaluate("location.hash = 'diagram?task=SPEED'")
            page.locator(".view-diagram g.box").first.wait_for()
            page.wait_for_timeout(1000)
            took = updates(page)
            print(f"  an update of all its wires   median {statistics.median(took):6.2f}  most {max(took):6.2f} ms")
            page.evaluate("address => { location.hash = address }", TRENDS)
            page.wait_for_timeout(2000)
            used = heap(page, minutes)
            print(f"  memory with 9 trends open, {minutes:g} min   first {used[0]:.2f}  last {used[-1]:.2f} MB")


if __name__ == "__main__":
    main()
