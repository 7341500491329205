"""The page over an hour with trends open: its memory does not grow."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from rack.helpers import rack_at

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.panel.live_rack import RackSource
from automax_ros.panel.source import Asked, Frame
from automax_ros.runtime.time.turns import Turns
from panel.browser.pages import opened, show
from panel.support import served

DRIVE = Path(__file__).parents[3] / "config" / "section_drive" / "rack.yaml"
TRENDS = "trends?names=SPEED_FDBK%25,SECT_REF%25;CUR_REF%25,ARM_CUR%25;TACH%25,LINE_REF%25;RUN@,SECTION/speed_rpm"
FRAME_NS = 50 * NS_PER_MS
HOUR_NS = 3600 * NS_PER_S


class QuickRack(RackSource):
    """A rack whose time goes on by a frame with each frame that is sent."""

    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        if any(item.names for item in asked):
            self._rack.scheduler.run_until(self._rack.now_ns + FRAME_NS)
        return super().frames(asked)


@pytest.mark.soak
def test_memory_stays_as_it_is_over_an_hour_of_trends(page: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("automax_ros.panel.server.FRAME_S", 0.001)
    rack = rack_at(DRIVE)
    rack.start([("LINE_REF%", 2000)])
    with served(QuickRack(rack, Turns().turn, title="an hour")) as server:
        opened(page, server.address)
        show(page, TRENDS)
        session = page.context.new_cdp_session(page)

        def used_mb(until_ns: int) -> float:
            while rack.now_ns < until_ns:
                page.wait_for_timeout(500)
            session.send("HeapProfiler.collectGarbage")
            usage = session.send("Runtime.getHeapUsage")
            return float(usage["usedSize"] + usage["backingStorageSize"]) / 1e6

        # In its first minutes the page is still being compiled.
        used = [used_mb(part * HOUR_NS // 4) for part in (1, 2, 3, 4, 5)]
        print([f"{each:.2f} MB" for each in used])
        assert page.locator(".lane").count() == 4
    assert max(used[1:]) - used[0] < 1.0
