"""The example of docs/basic_tasks.md runs, and does what the page says."""

from __future__ import annotations

import re
from pathlib import Path

from rack.helpers import rack_at

PAGE = Path(__file__).parents[2] / "docs" / "basic_tasks.md"
FILES = re.findall(
    r"^```(?:blk|bas) (\w+\.B\w\w)\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
)
RACK = """\
rack: PAGE
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {LINE: {priority: 6}, WATCH: {priority: 11}}}
  2: {module: 57C435, tasks: {REPORT: {priority: 11}}}
common:
  SPEED%: {preset: 40}
  METRES!: {}
  KILOMETRES%: {}
"""


def test_the_example_reports_each_fifth_kilometre(tmp_path):
    assert [name for name, _ in FILES] == ["LINE.BLK", "WATCH.BAS", "REPORT.BAS"]
    for name, text in FILES:
        (tmp_path / name).write_text(text)
    (tmp_path / "rack.yaml").write_text(RACK)
    rack = rack_at(tmp_path / "rack.yaml")
    assert rack.warnings == []
    rack.start()
    for speed in (40, 70, 55):
        rack.write("SPEED%", speed)
        rack.run(11)
    # 100 scans in 11 s: 4, 7 and 5.5 km.
    assert rack.value("METRES!") == 16_500
    assert rack.value("KILOMETRES%") == 16
    assert list(rack.task("REPORT").printed) == ["5 km, fastest 70", "10 km, fastest 70", "15 km, fastest 70"]
