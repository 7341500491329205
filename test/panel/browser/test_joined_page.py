"""The page of a rack that runs in another process, joined over DDS, in a real browser."""

import re
import signal
from collections.abc import Iterator
from typing import Any

import pytest
from system.support import ROOT, Automax

from panel.browser.pages import VIEWS, address_of, give, opened, show, shows

SECTION = ROOT / "config" / "section_drive" / "rack.yaml"


@pytest.fixture(scope="module")
def rack(module_domain_id) -> Iterator[Automax]:
    with Automax("run", SECTION) as process:
        process.wait_for_line("ROS 2 namespace")
        yield process


@pytest.fixture(scope="module")
def address(rack: Automax) -> Iterator[str]:
    with Automax("panel", "PM1", "--operate", "--port", "0") as process:
        yield address_of(process)


@pytest.fixture
def joined(page: Any, address: str) -> Any:
    return opened(page, address)


def test_its_cabinet_and_its_values_are_there(joined):
    shows(joined, "#header", "joined rack")
    joined.locator(".module h3").first.wait_for()
    assert joined.locator(".module h3").all_text_contents() == ["57C413", "57C435", "57C431"]
    for name in ("LINE", "SEQUENCE", "SPEED", "MOTOR"):
        joined.locator(".module a.good", has_text=name).wait_for()
    row = joined.locator(".watched tr", has_text="SPEED_FDBK%").locator(".value")
    row.filter(has_text=re.compile(r"\d")).wait_for()
    before = row.text_content()
    joined.locator(".watched tr", has_text="SPEED_FDBK%").filter(has_not_text=str(before)).wait_for()


@pytest.mark.parametrize("view", VIEWS)
def test_each_view_opens(joined, view):
    """Of any source: what is there is tested where it comes from; a script that raises fails each of these."""
    show(joined, view)
    joined.wait_for_timeout(300)
    assert joined.locator("nav a[aria-current=page]").first.get_attribute("href") == f"#{view}"
    assert joined.locator("#main").inner_text().strip()


def test_a_net_that_memory_no_longer_holds_is_grey_and_says_why(joined):
    show(joined, "diagram?task=SPEED")
    joined.wait_for_selector(".view-diagram g.box")
    rows = joined.locator(".view-diagram .source .row", has_text="OUTPUT=SPARE%")
    rows.nth(2).locator(".value").filter(has_text=re.compile(r"\d")).wait_for()
    assert rows.locator(".value.unknown").all_text_contents() == ["?", "?"]
    titles = joined.locator(".view-diagram g.net title", has_text="SPARE%").all_text_contents()
    assert sum("Memory keeps what a later line writes" in text for text in titles) == 2


def test_its_operator_does_what_was_confirmed(joined):
    give(joined, "LINE_SPEED_SP%", "800")
    joined.locator(".memory-table tr .value", has_text="800").wait_for()
    show(joined, "log")
    shows(joined, ".log-table", "LINE_SPEED_SP%")


def test_a_rack_that_has_gone_is_told(joined, rack):
    rack.end(signal.SIGINT)
    shows(joined, "#header .bad", "gone")
