"""Makes the pictures of docs/howto/panel.md: the page as Chromium shows it, of the example drive and of a recording.

`.venv/bin/python tools/panel_pictures.py [CHROMIUM]` writes them into docs/pictures/. The drive is run in simulated
time until its emergency stop is pressed; so each run gives the same values, but another browser or other fonts draw
other bytes.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures"
STIMULI = "- {at: 3.0, plant: {MOTOR: {load_torque_nm: 300}}}\n- {at: 9.0, set: {ESTOP_OK@: false}}\n"
"""What happens to the example drive before its pictures are made."""
DRIVE = ("run", ROOT / "config" / "dc_drive", "--simulated", "--duration", "10", "--panel", "--port", "0")
BAG = ("panel", ROOT / "bags" / "section_drive", "--port", "0")
OF_DRIVE = {"panel_rack.png": "rack", "panel_drive.png": "drive"}
OF_BAG = {
    "panel_diagram.png": "diagram?task=SPEED&line=1230",
    "panel_trends.png": "trends?names=SPEED_FDBK%25,SECT_REF%25;CUR_REF%25;RUN@",
}
SIZE = {"width": 1200, "height": 700}
"""Pixels of a picture."""


def make(browser: Any, folder: Path) -> None:
    """Write all pictures into a folder; ``browser`` is Playwright's."""
    with tempfile.TemporaryDirectory() as scratch:
        stimuli = Path(scratch) / "stop.yaml"
        stimuli.write_text(STIMULI, encoding="utf-8")
        for words, pictures in (((*DRIVE, "--stimuli", stimuli), OF_DRIVE), (BAG, OF_BAG)):
            with _served(words) as address:
                _shoot(browser, address, folder, pictures)


def _shoot(browser: Any, address: str, folder: Path, pictures: dict[str, str]) -> None:
    context = browser.new_context(viewport=SIZE, color_scheme="light", reduced_motion="reduce")
    page = context.new_page()
    page.goto(address)
    for name, view in pictures.items():
        page.evaluate("view => { location.hash = view }", view)
        page.wait_for_selector(f".view-{view.partition('?')[0]}")
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(1500)
        page.screenshot(path=folder / name)
    context.close()


@contextmanager
def _served(words: tuple[object, ...]) -> Iterator[str]:
    """Run a program with a panel and give the address that it prints."""
    command = [sys.executable, "-m", "automax_ros.cli.main", *map(str, words)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            found = (re.search(r"http://\S+", line) for line in process.stdout)
            yield next(match[0] for match in found if match is not None)
        finally:
            process.terminate()


if __name__ == "__main__":
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = sys.argv[1] if len(sys.argv) > 1 else "/usr/bin/chromium"
        make(playwright.chromium.launch(executable_path=path, args=["--no-sandbox"]), PICTURES)
