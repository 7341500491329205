"""The drives of a line on the page: the webs that come and go, and what is done to them by a click."""

import re
from collections.abc import Iterator
from typing import Any

import pytest
from messages.stream.webs import SPEED, WIND, YAML
from system.support import Automax

from panel.browser.pages import address_of, confirm, opened, show, shows

NEWTONS = re.compile(r"W1 \d+\.\d N")


@pytest.fixture(scope="module")
def rack(module_domain_id, tmp_path_factory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("line")
    (folder / "rack.yaml").write_text(YAML)
    (folder / "SPEED.BLK").write_text(SPEED)
    (folder / "WIND.BLK").write_text(WIND)
    with Automax("run", folder, "--panel", "--operate", "--port", "0") as process:
        yield address_of(process)


@pytest.fixture
def line(page: Any, rack: str) -> Any:
    return opened(page, rack, "drive")


def test_each_drive_stands_between_its_webs(line):
    unwind, press = (line.locator(f".drive-webs[aria-label='Webs of {name}']") for name in ("UNWIND", "PRESS"))
    unwind.filter(has_text=NEWTONS).wait_for()
    assert re.fullmatch(r"UNWINDW1 [\d.]+ N →PRESS", unwind.text_content())
    press.filter(has_text=NEWTONS).wait_for()
    assert re.fullmatch(r"UNWINDW1 [\d.]+ N →PRESSW2 [\d.]+ N →PULL", press.text_content())
    card = line.locator("article.drive", has=unwind)
    diameter = card.locator(".reading", has_text="Diameter").locator("b")
    assert re.fullmatch(r"1\.2[345]\d", diameter.text_content())
    assert card.locator(".control.splice").count() == 1
    assert card.locator(".control.slip").count() == 0
    assert [control.text_content() for control in card.locator(".control.thread").all()] == ["W1 thread"]
    heads = line.locator(".drive-head")
    assert "slot 7" in heads.nth(0).text_content()
    assert "drive" not in heads.nth(0).text_content()
    assert "slot 10, drive B" in heads.nth(1).text_content()


def test_a_web_is_broken_and_a_roll_spliced_by_a_click(line):
    unwind = line.locator("article.drive", has=line.locator("[aria-label='Webs of UNWIND']"))
    unwind.locator("button:text-is('W1 break')").click()
    assert confirm(line) == "break web W1"
    unwind.locator(".web.broken", has_text="W1 broken").wait_for()
    splice = unwind.locator(".control.splice")
    splice.locator("input").fill("0.6")
    splice.locator("button").click()
    assert confirm(line) == "plant UNWIND: splice 0.6"
    unwind.locator(".reading", has_text="Diameter").locator("b:text-is('0.600')").wait_for()
    thread = unwind.locator("button:text-is('W1 thread')")
    assert thread.get_attribute("title") == "thread web W1"
    thread.click()
    assert line.locator("dialog .sentence").text_content() == "thread web W1 again, without tension"
    line.click("dialog button:has-text('Confirm')")
    shows(line, "dialog .bad", "slow both down to 0.5 m/s")
    line.keyboard.press("Escape")


def test_signals_of_webs_are_names_of_memory_and_trends(line):
    show(line, "memory?q=W2/")
    rows = line.locator(".memory-table tbody th")
    rows.filter(has_text="W2/tension_n").wait_for()
    assert {text.strip("▸") for text in rows.all_text_contents()} == {
        f"W2/{signal}" for signal in ("tension_n", "strain_percent", "draw_percent", "slack_m", "dancer_m", "broken")
    }
    row = line.locator(".memory-table tbody tr", has_text="W2/tension_n")
    row.locator(".value").filter(has_text=re.compile(r"\d")).wait_for()
    show(line, "drive")
    line.click("a:has-text('Speed, current and tension as trends')")
    shows(line, ".view-trends", "W1/tension_n")
