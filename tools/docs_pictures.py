"""Makes the pictures of the documentation from a simulated run of the example rack, so that they stay up to date.

`.venv/bin/python tools/docs_pictures.py` writes them into docs/pictures/: the drawings of `automax report` and
`automax plot` for the tour through config/dc_drive, that of `automax report` for bags/paper_line, those of
`automax compare` and, for a task, `automax diagram` for config/section_drive, and the terminal while the rack runs. The
same rack and the same matplotlib give the same bytes.
"""

from __future__ import annotations

import sys
import tempfile
from html import escape
from pathlib import Path

from automax_ros.cli.main import main
from automax_ros.cli.run.status import Progress, StatusDisplay, Summary, TerminalOutput
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.model.value_names import watched

ROOT = Path(__file__).resolve().parent.parent
RACK = ROOT / "config" / "dc_drive"
SECTION = ROOT / "config" / "section_drive"
PAPER = ROOT / "bags" / "paper_line"
PICTURES = ROOT / "docs" / "pictures"
PLOTTED = ("SPEED_REF%", "SPD%", "CUR_REF%", "CUR_FB%", "BRIDGE@", "F_SCR@")
NIP = """\
- {at: 0, set: {LINE_SPEED_SP%: 100}}
- {at: 2.0, set: {NIP_CLOSED@: true}}
"""
SLOW = "- {at: 0, tune: {SPEED.KP_SPEED: 10.0}}\n"
"""What happens to the section in the two runs that are compared, and what only the second one has: a lower gain."""
COMPARED = ("SPEED_FDBK%", "CUR_REF%", "NIP_CLOSED@", "--reference", "SPEED_FDBK%=SECT_REF%", "--to", "8")
SCREEN_S = (1, 3, 5, 8)
"""Seconds of the run at which the status line is shown."""
_LETTER, _LINE, _EDGE = 8.0, 19, 14
"""Width of a letter and height of a line of the terminal, and the margin around them, in pixels."""


def make(folder: Path) -> None:
    """Write all pictures into a folder."""
    with tempfile.TemporaryDirectory() as scratch:
        bag = Path(scratch) / "tour"
        tour = ("--simulated", "--duration", "40", "--stimuli", RACK / "tour.yaml", "--record", bag)
        _automax("run", RACK, *tour)
        _automax("report", bag, "--png", folder / "report.png", "--speed-ref", "SPEED_REF%")
        _automax("report", PAPER, "--png", folder / "line_report.png")
        _automax("plot", bag, *PLOTTED, "--to", "24", "--size", "1200x640", "-o", folder / "plot.png")
        runs, stimuli = [Path(scratch) / name for name in ("before", "after")], Path(scratch) / "nip.yaml"
        for run, entries in zip(runs, (NIP, NIP + SLOW), strict=True):
            stimuli.write_text(entries, encoding="utf-8")
            _automax("run", SECTION, "--simulated", "--duration", "12", "--stimuli", stimuli, "--record", run)
        _automax("compare", *runs, *COMPARED, "--plot", folder / "compare.png", expected=1)
    _automax("diagram", ROOT / "config" / "section_drive" / "SPEED.BLK", "-o", folder / "speed_diagram.svg")
    (folder / "screen.svg").write_text(screen(), encoding="utf-8")


def screen() -> str:
    """Return the terminal of a run as SVG: the status line at some instants."""
    lines = ["$ make run", *status_lines()]
    width = round(2 * _EDGE + _LETTER * max(map(len, lines)))
    height = 2 * _EDGE + _LINE * len(lines)
    rows = "\n".join(
        f'<text x="{_EDGE}" y="{_EDGE + _LINE * number + 14}" textLength="{_LETTER * len(line):g}" '
        f'lengthAdjust="spacingAndGlyphs" xml:space="preserve">{escape(line)}</text>'
        for number, line in enumerate(lines)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="monospace" font-size="13" fill="#e0e0e0" role="img">\n'
        "<title>The line of status of a rack: its time, scans, and the commons that its file watches</title>\n"
        f'<rect width="{width}" height="{height}" rx="6" fill="#20262b"/>\n{rows}\n</svg>\n'
    )


def status_lines() -> list[str]:
    """Return the rack's status lines as `automax run` shows them, without values that depend on the host's speed."""
    config = load(RACK / "rack.yaml").config
    assert config is not None
    rack = Rack(config)
    shown = _Shown()
    display = StatusDisplay(rack, watched(config, None), live=False, screen=shown)
    rack.start()
    for second in SCREEN_S:
        rack.scheduler.run_until(second * NS_PER_S)
        display.update(rack.now_ns)
    return ["  ".join(part for part in parts if not part.endswith("x")) for parts in shown.lines]


class _Shown(TerminalOutput):
    """A screen that stores the lines shown on it; the next line is always due."""

    def __init__(self) -> None:
        super().__init__()
        self.began_ns = 0
        self.lines: list[list[str]] = []

    def due(self) -> int:
        return 1

    def progress(self, progress: Progress) -> None:
        self.lines.append(progress.parts)

    def message(self, text: str) -> None:
        raise RuntimeError(f"the example has trouble: {text}")

    def summary(self, summary: Summary) -> None:
        """Discard the summary."""


def _automax(*words: object, expected: int = 0) -> None:
    if main([str(word) for word in words]) != expected:
        sys.exit(f"automax {words[0]} failed")


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    make(PICTURES)
