"""The page of a recording in a real browser: scans on the wires, scrubbing, a first difference, hostile texts."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from system.support import ROOT, Automax, automax_here

from panel.browser.pages import VIEWS, address_of, opened, show, shows

BAG = ROOT / "bags" / "section_drive"
SPEED = (ROOT / "config" / "section_drive" / "SPEED.BLK").read_text()
EVIL = "<img src=x onerror=document.title='broken'>"
HOSTILE_RACK = f"""rack: EVIL
slots:
  0:
    module: 57C435
    tick_ms: 5.5
    tasks:
      T: {{priority: 4}}
common:
  A%: {{unit: "<b>x</b>", description: "{EVIL}"}}
  B@: {{description: "</title><script>document.title='broken'</script>"}}
watch: [A%, B@]
"""
HOSTILE_TASK = f"""100 REM {EVIL}
110 REM </text><script>document.title='broken'</script>
120 COMMON A%, B@
130 LOCAL N%, S$
1000 CALL SCAN_LOOP(TICKS=1)
1010 S$ = "<img src=x onerror=alert(1)>"
1020 N% = N% + 1
1030 CALL DIFFERENCE(INPUT1=N%, INPUT2=0, OUTPUT=A%)
1040 CALL COMPARE(INPUT1=N%, INPUT2=50, OUTPUT_GTR=B@)
9000 END
"""


@pytest.fixture(scope="module")
def recording() -> Iterator[str]:
    with Automax("panel", BAG, "--port", "0") as process:
        yield address_of(process)


@pytest.fixture
def bag(page: Any, recording: str) -> Any:
    return opened(page, recording)


def seek(page: Any, task: str, scan: int) -> None:
    """Go to a scan by the bar of the recording."""
    page.select_option(".player select >> nth=1", task)
    page.fill(".player input[type=number]", str(scan))
    page.keyboard.press("Enter")


def test_each_writer_of_a_reused_local_has_its_value_of_the_scan(bag):
    """SPARE% is written by three blocks of SPEED: memory has the last value, the scan executed again all three."""
    show(bag, "diagram?task=SPEED")
    seek(bag, "SPEED", 910)
    shows(bag, ".scan-at", "scan 910")
    wires = bag.locator(".view-diagram g.net", has_text="SPARE%")
    assert wires.count() == 3
    rows = bag.locator(".view-diagram .source .row", has_text="OUTPUT=SPARE%")
    assert [re.findall(r"-?\d+$", text)[0] for text in rows.all_text_contents()] == ["1636", "1200", "205"]


@pytest.mark.parametrize("view", VIEWS)
def test_each_view_opens(bag, view):
    """What is there is tested where it comes from; a script that raises fails each of these."""
    show(bag, view)
    bag.wait_for_timeout(300)
    assert bag.locator("#main").inner_text().strip()
    assert bag.locator("#player").is_visible()


def test_the_cabinet_of_a_recording_is_that_of_its_rack(bag):
    bag.locator(".module h3").first.wait_for()
    assert bag.locator(".module h3").all_text_contents() == ["57C413", "57C435", "57C431"]
    shows(bag, "#header", "recording")
    shows(bag, ".watched tr", "SPEED_FDBK%")


def test_time_is_scrubbed_and_scans_are_stepped(bag):
    show(bag, "diagram?task=SPEED")
    seek(bag, "SPEED", 300)
    shows(bag, ".scan-at", "scan 300")
    before = bag.locator(".view-diagram .source .row", has_text="1120 CALL LAG").text_content()
    bag.click(".player button[title^='One scan on']")
    shows(bag, ".scan-at", "scan 301")
    bag.locator(".player input[type=range]").evaluate(
        "node => { node.value = 800000; node.dispatchEvent(new Event('input')) }"
    )
    shows(bag, ".player .time", "8.0000 s")
    shows(bag, ".scan-at", "scan 72")
    after = bag.locator(".view-diagram .source .row", has_text="1120 CALL LAG").text_content()
    assert before != after


def test_a_page_that_is_loaded_again_shows_the_same_time(bag):
    show(bag, "diagram?task=SPEED")
    bag.locator(".player input[type=range]").evaluate(
        "node => { node.value = 800000; node.dispatchEvent(new Event('input')) }"
    )
    bag.wait_for_url(re.compile(r"\?at=8000000000#diagram"))
    bag.reload()
    shows(bag, ".player .time", "8.0000 s")
    shows(bag, ".scan-at", "scan 72")


def test_a_number_that_is_being_typed_is_not_replaced(bag):
    """The answer about the present scan may come between typing and Enter."""
    seek(bag, "SPEED", 300)
    bag.locator(".player input[type=number]").press_sequentially("1")
    typed = bag.locator(".player input[type=number]").input_value()
    bag.locator(".player input[type=range]").evaluate(
        "node => { node.value = 500000; node.dispatchEvent(new Event('input')) }"
    )
    shows(bag, ".player .time", "5.0000 s")
    bag.wait_for_timeout(600)
    assert bag.locator(".player input[type=number]").input_value() == typed


def test_a_number_that_is_about_to_be_typed_is_not_replaced(bag):
    """What was selected would be lost, and the new digits stood after the old ones."""
    seek(bag, "SPEED", 300)
    bag.locator(".player input[type=number]").select_text()
    bag.locator(".player input[type=range]").evaluate(
        "node => { node.value = 500000; node.dispatchEvent(new Event('input')) }"
    )
    shows(bag, ".player .time", "5.0000 s")
    bag.wait_for_timeout(600)
    bag.keyboard.insert_text("910")
    bag.keyboard.press("Enter")
    shows(bag, ".player .time", "9.9")


def test_the_number_of_the_scan_is_shown_once_the_field_is_left(bag):
    seek(bag, "SPEED", 300)
    bag.locator(".player input[type=range]").evaluate(
        "node => { node.value = 500000; node.dispatchEvent(new Event('input')) }"
    )
    shows(bag, ".player .time", "5.0000 s")
    bag.locator(".player input[type=number]").blur()
    bag.wait_for_function("() => Math.abs(document.querySelector('.player input[type=number]').value - 454) < 3")


def test_values_come_after_a_look_at_something_else_however_late_the_answers_are(page, recording):
    """The list that is watched is the last one that was asked for, not the last one that was answered before."""
    page.add_init_script(
        "const send = WebSocket.prototype.send;"
        "WebSocket.prototype.send = function (text) { setTimeout(() => send.call(this, text), 300) }"
    )
    opened(page, recording)
    show(page, "memory?watch=SPEED_FDBK%25&only=1")
    shows(page, ".memory-table tbody .value", "1")
    show(page, "memory?watch=SECT_REF%25&only=1")
    page.wait_for_timeout(100)
    show(page, "memory?watch=SPEED_FDBK%25&only=1")
    page.wait_for_timeout(1000)
    shows(page, ".memory-table tbody .value", "1")


def test_it_plays_to_its_end(bag):
    seek(bag, "SPEED", 880)
    shows(bag, ".player .time", "9.6")
    bag.click(".player button[title^='Play']")
    shows(bag, ".player .time", "10.0")


def test_values_of_all_memory_are_there_at_any_time(bag):
    show(bag, "memory?watch=SPEED_FDBK%25,WEB_LENGTH!&only=1")
    seek(bag, "SPEED", 0)
    shows(bag, ".memory-table tbody .value", "0")
    seek(bag, "SPEED", 910)
    shows(bag, ".memory-table tbody .value", "1636")
    assert bag.locator(".memory-table button:has-text('Change')").count() == 0, "a recording is not operated"


def test_trends_have_the_history_at_once(bag):
    show(bag, "trends?names=SPEED_FDBK%25,SECT_REF%25;RUN@")
    bag.wait_for_selector(".view-trends canvas")
    shows(bag, ".view-trends", "SECT_REF%")


def test_trends_draw_counts_with_a_scale_in_their_unit(page):
    """TENSION_1% goes up to 2319 counts, which are 566 N: the labels of the axis, read off the canvas, are N."""
    with Automax("panel", ROOT / "bags" / "paper_line", "--port", "0") as process:
        opened(page, address_of(process))
        page.evaluate(
            """() => {
                const { prototype } = CanvasRenderingContext2D;
                const [{ fillText }, drawn] = [prototype, document.body.dataset];
                prototype.fillText = function (text, ...more) {
                    if (/^[0-9]{3,}$/.test(text)) drawn.drawn = `${drawn.drawn ?? ""} ${text}`;
                    fillText.call(this, text, ...more);
                };
            }"""
        )
        show(page, "trends?names=TENSION_1%25")
        shows(page, ".view-trends th small", "N")
        page.wait_for_selector("body[data-drawn~='400']")
        assert max(map(int, page.get_attribute("body", "data-drawn").split())) < 1000
        plot = page.locator(".view-trends .u-over")
        box = plot.bounding_box()
        for share in (0.02, 0.5):
            plot.click(position={"x": share * box["width"], "y": box["height"] / 2})
        shows(page, ".view-trends td.B", re.compile(r"^\d+ = [\d.]+ N$"))
        page.locator(".view-trends td.difference", has_text="Δ").wait_for()
        value = float(page.locator(".view-trends td.B").inner_text().split()[2])
        change = float(page.locator(".view-trends td.difference").inner_text().split()[1])
        assert change == pytest.approx(value, abs=0.01)  # from a web without tension


def test_an_edited_task_opens_at_its_first_difference_with_both_values(page, tmp_path):
    edited = tmp_path / "SPEED.BLK"
    edited.write_text(SPEED.replace("CURRENT=26.7", "CURRENT=20.0"))
    with Automax("panel", BAG, "--task", f"SPEED={edited}", "--port", "0") as process:
        opened(page, address_of(process))
        page.locator(".player button", has_text="First difference: SPEED, scan").click()
        page.wait_for_selector(".view-diagram .differs .other", state="attached")
        row = page.locator(".view-diagram .source .row", has_text="OUTPUT=CUR_PI%)")
        row.locator(".differs").wait_for()
        own, other = re.findall(r"-?\d+", str(row.locator(".value").text_content()))
        assert own != other


def test_a_second_recording_is_shown_with_it(page, tmp_path):
    run = ("run", ROOT / "config" / "section_drive", "--simulated", "--duration", "2", "--record")
    assert automax_here(*run, tmp_path / "one").code == 0
    assert automax_here(*run, tmp_path / "two", "--set", "LINE_SPEED_SP%=900", "--set", "DRAW%=9900").code == 0
    with Automax("panel", tmp_path / "one", "--against", tmp_path / "two", "--port", "0") as process:
        opened(page, address_of(process))
        page.locator(".player button", has_text="First difference:").click()
        page.wait_for_selector(".view-diagram .differs .other", state="attached")


def test_texts_of_a_recording_are_shown_as_texts(page, tmp_path):
    (tmp_path / "rack.yaml").write_text(HOSTILE_RACK)
    (tmp_path / "T.BLK").write_text(HOSTILE_TASK)
    bag: Path = tmp_path / "bag"
    assert automax_here("run", tmp_path, "--simulated", "--duration", "1", "--record", bag).code == 0
    with Automax("panel", bag, "--port", "0") as process:
        opened(page, address_of(process))
        for view in (
            "rack",
            "memory",
            "tasks",
            "log",
            "trends?names=A%25",
            f"memory?q={EVIL}",
            f"log?q={EVIL}",
            "diagram",
        ):
            show(page, view)
            page.wait_for_timeout(100)
            assert page.locator("img, main script, iframe").count() == 0, view
        shows(page, ".source .row", EVIL)
        assert "broken" not in page.title()
