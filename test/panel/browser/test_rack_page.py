"""The page of a rack that runs, in a real browser: the example drive, operated as a person would."""

import re
import signal
from collections.abc import Iterator
from typing import Any

import pytest
from system.support import ROOT, Automax

from panel.browser.pages import address_of, confirm, give, opened, show, shows

DRIVE = ROOT / "config" / "dc_drive" / "rack.yaml"


@pytest.fixture(scope="module")
def rack(module_domain_id) -> Iterator[str]:
    """The example drive with a panel that may operate it; the address."""
    with Automax("run", DRIVE, "--panel", "--operate", "--port", "0") as process:
        yield address_of(process)


@pytest.fixture
def drive(page: Any, rack: str) -> Any:
    return opened(page, rack)


def value(page: Any, name: str) -> str:
    """The value of a commons' row on the page of the rack."""
    return str(page.locator(".values tr", has_text=name).first.locator(".value").text_content())


def turning(page: Any, low: int, high: int) -> None:
    """Wait until the motor turns at a speed in rpm."""
    page.wait_for_function(
        """([low, high]) => [...document.querySelectorAll('.watched tr')].some((row) => {
            const rpm = parseFloat(row.querySelector('.value').textContent)
            return row.textContent.startsWith('RPM') && low <= rpm && rpm <= high })""",
        arg=[low, high],
    )


def test_the_cabinet_stands_as_in_the_rack_file(drive):
    drive.locator(".module h3").first.wait_for()
    modules = drive.locator(".module h3").all_text_contents()
    assert modules == ["57C413", "57C435", "57C419", "57C402", "57C406", "57C408", "57C405"]
    assert drive.locator(".module .slot").all_text_contents() == ["0", "1", "5", "6", "7", "8", "9"]
    assert set(drive.locator(".module a.chip").all_text_contents()) >= {"CML", "SPEED", "SEQ", "DIAG"}
    shows(drive, "#header", "DRIVE1")
    shows(drive, "#header .good", "runs")


def test_a_value_that_is_set_changes_what_the_motor_does(drive):
    turning(drive, 1190, 1210)
    shows(drive, ".way", "No condition is open")
    sentence = give(drive, "SPEED_SP%", "-600")
    for part in ("SPEED_SP%", "-600", "1200"):
        assert part in sentence
    show(drive, "rack")
    turning(drive, -610, -590)
    give(drive, "SPEED_SP%", "1200")
    show(drive, "rack")
    turning(drive, 1190, 1210)
    show(drive, "log")
    shows(drive, ".log-table", "-600")


def test_nothing_is_done_before_it_is_confirmed(drive):
    show(drive, "memory?q=SPEED_SP")
    shows(drive, ".memory-table tbody tr .value", "1200")
    drive.locator(".memory-table button:has-text('Change')").first.click()
    drive.fill("dialog input", "77")
    drive.click("dialog button:has-text('Set')")
    shows(drive, "dialog .sentence", "77")
    drive.keyboard.press("Escape")
    drive.locator("dialog .sentence").wait_for(state="detached")
    assert drive.input_value("dialog input") == "77", "another value can be given at once"
    drive.keyboard.press("Escape")
    drive.wait_for_selector("dialog", state="detached")
    drive.wait_for_timeout(300)
    assert drive.locator(".memory-table tbody tr .value").first.text_content() == "1200"


def test_a_force_is_marked_wherever_its_name_stands(drive):
    give(drive, "CUR_REF%", "100", "Force")
    shows(drive, "#header .forced", "1 forced")
    drive.wait_for_selector(".memory-table tr.forced")
    show(drive, "diagram?task=SPEED")
    drive.wait_for_selector(".view-diagram g.net.forced", state="attached")
    shows(drive, ".view-diagram .forced", "100")
    show(drive, "memory?q=CUR_REF")
    drive.locator(".memory-table button:has-text('Change')").first.click()
    drive.click("dialog button:has-text('End force')")
    confirm(drive)
    drive.wait_for_selector(".memory-table tr.forced", state="detached")


def test_a_refusal_gives_the_racks_reason(drive):
    show(drive, "memory?q=SPEED_SP")
    drive.locator(".memory-table button:has-text('Change')").first.click()
    drive.fill("dialog input", "99999")
    drive.click("dialog button:has-text('Set')")
    shows(drive, "dialog .bad", "-32768 to 32767")
    assert drive.input_value("dialog input") == "99999"


def test_what_holds_a_drive_without_a_fault_is_named(drive):
    give(drive, "STOP_PB@", "FALSE", "Force")
    show(drive, "rack")
    shows(drive, ".way", "STOP_PB@ is forced")
    shows(drive, ".hand .forced", "FALSE")
    show(drive, "memory?q=STOP_PB")
    drive.locator(".memory-table button:has-text('Change')").first.click()
    shows(drive, "dialog .hint", "FALSE, forced")
    drive.click("dialog button:has-text('End force')")
    assert confirm(drive) == "end the force of STOP_PB@: STOP_PB@ is forced now"
    shows(drive, "#said", "Done: end the force of STOP_PB@")
    show(drive, "tasks")
    row = drive.locator(".task-table tr", has_text="DIAG")
    row.locator("button:has-text('stop')").click()
    confirm(drive)
    show(drive, "rack")
    shows(drive, ".way", "DIAG is stopped")
    show(drive, "tasks")
    row.locator("button:has-text('run')").click()
    confirm(drive)


def test_back_goes_to_the_task_that_was_shown(drive):
    """Also where one goes on before the drawing has come: an answer that comes late is not drawn."""
    here = ".view-diagram nav a[aria-current=page]"
    show(drive, "diagram")
    first = drive.locator(here).text_content()
    show(drive, "diagram?task=SPEED")
    drive.locator(f"{here}:text-is('SPEED')").wait_for()
    drive.go_back()
    drive.locator(f"{here}:text-is('{first}')").wait_for()
    drive.evaluate("() => { for (const task of ['SPEED', 'DIAG', 'SPEED']) location.hash = `diagram?task=${task}` }")
    drive.locator(f"{here}:text-is('SPEED')").wait_for()
    shows(drive, ".view-diagram .source", "CALL RAMP")


def test_a_wire_has_the_value_of_memory(drive):
    show(drive, "diagram?task=SPEED")
    drive.wait_for_selector(".view-diagram svg g.box")
    titles = drive.locator(".view-diagram .box-title").all_text_contents()
    assert sorted(titles) == ["DIFFERENCE", "LIMIT", "PROP_INT", "RAMP", "SCALE", "SWITCH"]
    shows(drive, ".view-diagram svg text.value", "1200")
    drive.wait_for_selector(".view-diagram svg g.net.true", state="attached")
    shows(drive, ".view-diagram .source .row", "CALL RAMP")
    box = drive.locator(".view-diagram g.box", has_text="RAMP")
    box.hover()
    lit = drive.locator(".view-diagram .source .row.lit")
    lit.first.wait_for()
    assert "CALL RAMP" in lit.first.text_content()


def test_a_task_with_jumps_is_its_source_with_values(drive):
    show(drive, "diagram?task=DIAG")
    shows(drive, ".view-diagram .why", "BASIC task")
    drive.wait_for_selector(".view-diagram .source .row .value")


def test_a_fault_of_the_drive_is_provoked_and_repaired_by_clicks(drive):
    show(drive, "drive")
    drive.wait_for_selector(".scr.on")
    drive.locator(".control.short_scr button", has_text=re.compile("^3$")).click()
    assert "short_scr" in confirm(drive)
    drive.wait_for_selector(".scr.shorted")
    shows(drive, ".drive-side", "short scr")
    show(drive, "rack")
    shows(drive, ".way .bad", "MOTOR")
    show(drive, "drive")
    drive.locator(".control.repair button").click()
    confirm(drive)
    drive.wait_for_selector(".scr.shorted", state="detached")
    for pressed in ("TRUE", "FALSE"):
        give(drive, "RESET_PB@", pressed)


def test_the_first_page_tells_why_the_drive_does_not_start_after_an_emergency_stop(drive):
    give(drive, "ESTOP_OK@", "FALSE")
    show(drive, "rack")
    shows(drive, ".way tr", "ESTOP_OK@")
    first = drive.locator(".way tr").first
    assert "emergency stop" in first.text_content()
    assert "FALSE" in first.text_content()
    turning(drive, -5, 5)
    give(drive, "ESTOP_OK@", "TRUE")
    show(drive, "rack")
    drive.locator(".way tr", has_text="ESTOP_OK@").wait_for(state="detached")
    shows(drive, ".hand", "START")
    for pressed in ("FALSE", "TRUE"):
        give(drive, "START_PB@", pressed)
    show(drive, "rack")
    turning(drive, 1190, 1210)


def test_trends_draw_what_passes_and_keep_their_names_in_the_address(drive):
    show(drive, "trends?names=SPD%25,CUR_FB%25;FAULT@")
    drive.wait_for_selector(".view-trends canvas")
    shows(drive, ".view-trends", "CUR_FB%")
    shows(drive, ".view-trends", "FAULT@")


def test_three_browsers_see_the_same(browser, drive, rack):
    others = [browser.new_context() for _ in range(2)]
    try:
        pages = [drive, *(opened(other.new_page(), rack) for other in others)]
        give(drive, "SPEED_SP%", "900")
        show(drive, "rack")
        for each in pages:
            turning(each, 890, 910)
        give(drive, "SPEED_SP%", "1200")
    finally:
        for other in others:
            other.close()


def test_it_works_by_the_keyboard_and_on_a_phone(drive):
    drive.set_viewport_size({"width": 360, "height": 740})
    for view in ("rack", "memory", "trends", "drive", "tasks", "log", "diagram?task=SPEED"):
        show(drive, view)
        drive.wait_for_timeout(50)
        assert drive.evaluate("document.documentElement.scrollWidth") <= 360, view
    show(drive, "memory")
    drive.keyboard.press("/")
    assert drive.evaluate("document.activeElement.type") == "search"


def test_a_lost_connection_is_told_and_nothing_is_sent_again(browser, ros_domain_id):
    context = browser.new_context()
    try:
        with Automax("run", DRIVE, "--panel", "--operate", "--port", "0") as process:
            page = opened(context.new_page(), address_of(process))
            show(page, "memory?q=SPEED_SP")
            page.locator(".memory-table button:has-text('Change')").first.click()
            page.fill("dialog input", "500")
            page.click("dialog button:has-text('Set')")
            shows(page, "dialog .sentence", "500")
            process.end(signal.SIGINT)
        shows(page, "dialog [role=alert]", "nothing was sent")
        shows(page, "#alarm", "No connection")
        assert "lost" in page.get_attribute("body", "class")
        page.click("dialog button:has-text('Close')")
    finally:
        context.close()
