"""The commands of docs/howto/panel.md are typed as they stand there: each prints an address, and its page opens."""

import shlex
from pathlib import Path

import pytest
from docs.fences import fences
from system.support import ROOT, Automax, automax_here

from panel.browser.pages import address_of, opened, shows

PAGE = ROOT / "docs" / "howto" / "panel.md"
COMMANDS = [
    line.partition("#")[0].strip()
    for fence in fences(PAGE)
    if fence.language == "sh"
    for line in fence.text.splitlines()
    if line.startswith("automax ")
]


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> dict[str, Path]:
    """What the page calls its own: recordings, and an edited task."""
    folder = tmp_path_factory.mktemp("howto")
    (folder / "new").mkdir()
    text = (ROOT / "config" / "dc_drive" / "SPEED.BLK").read_text()
    (folder / "new" / "SPEED.BLK").write_text(text.replace("CURRENT=5.6", "CURRENT=5.0"))
    for name, speed in {"out": 1200, "before": 1200, "after": 600}.items():
        run = ("run", ROOT / "config" / "dc_drive", "--simulated", "--duration", "1", "--set", f"SPEED_SP%={speed}")
        assert automax_here(*run, "--record", folder / name).code == 0
    return {name: folder / name for name in ("out", "before", "after", "new/SPEED.BLK")}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_shows_a_page(page, ros_domain_id, made, command):
    words = [str(made.get(word, word)) for word in shlex.split(command)[1:]]
    words = [word.replace("new/SPEED.BLK", str(made["new/SPEED.BLK"])) for word in words]
    if words == ["panel", "DRIVE1"]:
        with Automax("run", ROOT / "config" / "dc_drive") as rack:
            rack.wait_for_line("ROS 2 namespace")
            look(page, words)
    else:
        look(page, words)


def look(page, words: list[str]) -> None:
    with Automax(*words, "--port", "0") as process:
        opened(page, address_of(process))
        shows(page, "#header strong", "PM1" if "section_drive" in " ".join(words) else "DRIVE1")
        if "--task" in words or "--against" in words:
            shows(page, ".player button", "First difference: ")


def test_make_run_shows_the_example_and_may_operate_it():
    (line,) = [line for line in (ROOT / "Makefile").read_text().splitlines() if "automax run" in line]
    assert line.endswith("automax run $(CONFIG) --panel --operate")
    assert "make run " in PAGE.read_text()
