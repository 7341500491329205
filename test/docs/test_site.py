"""The site of the documentation: it builds in strict mode, its links lead somewhere, its reference is the code's."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from urllib.parse import urlsplit

import pytest

from automax_ros.cli.shell.arguments import commands
from automax_ros.core.problems import PROBLEMS

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted(ROOT.glob("*/**/README.md"))]
OUTSIDE = [path for path in OUTSIDE if not {".venv", "site", "build"} & set(path.relative_to(ROOT).parts)]
"""Pages that people read where they stand in the repository."""
CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def tool(name: str) -> ModuleType:
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module
    finally:
        sys.path.remove(str(ROOT / "tools"))


SITE, PAGES = tool("docs_site"), tool("docs_pages")


def build(config: Path, site: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", config, "--site-dir", site],
        capture_output=True,
        text=True,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        timeout=110,
        check=False,
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    result = build(ROOT / "mkdocs.yml", folder)
    assert result.returncode == 0, result.stderr
    assert "WARNING" not in result.stderr
    return folder


def test_it_shows_every_page(site):
    pages = [path.relative_to(ROOT / "docs") for path in (ROOT / "docs").rglob("*.md")]
    assert len(pages) > 40
    for page in pages:
        name = "index" if page.stem == "README" else page.stem
        assert (site / page.with_name(f"{name}.html")).is_file()


def test_it_needs_no_network(site):
    """No script, font, style or picture of a page comes from elsewhere."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        fetched = re.findall(r"<(?:script|img|iframe)[^>]*src=[\"']?(\w+:)?//", text)
        fetched += re.findall(r"<link[^>]*rel=[\"']?(?:stylesheet|preconnect)[^>]*href=[\"']?https?:", text)
        assert fetched == [], page


def test_its_search_works_from_the_disk(site):
    """Finding 23. Browsers let a page from the disk neither fetch the index nor start a worker: both are scripts."""
    index = (site / "search" / "search_index.js").read_text(encoding="utf-8")
    assert index.startswith("var __index = {")
    assert '"location":"start.html#' in index
    shim = site / "assets" / "iframe-worker.js"
    assert 'location.protocol === "file:"' in shim.read_text(encoding="utf-8")
    for page in site.rglob("*.html"):
        (place,) = re.findall(r'<script src="([^"]*iframe-worker.js)"', page.read_text(encoding="utf-8"))
        assert (page.parent / place).resolve() == shim or page.name == "404.html"


def test_pictures_have_a_size_of_their_own(site):
    """Finding 23: an SVG without width and height is 0 x 0 pixels in its figure."""
    pictures = sorted({*(ROOT / "docs").rglob("*.svg"), *(ROOT / "docs").rglob("*.png")})
    assert len(pictures) >= 4
    for path in pictures:
        assert path.stat().st_size < 200_000
        assert (site / path.relative_to(ROOT / "docs")).is_file()
        if path.suffix == ".svg":
            assert re.match(
                r'<svg [^>]*width="\d+" height="\d+" viewBox="0 0 \d+ \d+"', path.read_text(encoding="utf-8")
            )


def test_drawings_fit_into_the_column(site):
    """Finding 23: they were cut at half. A block wider than the column says how many letters it is wide."""
    page = (site / "examples" / "dc_drive.html").read_text(encoding="utf-8")
    (columns,) = re.findall(
        r'<div style="--columns: (\d+)" class="drawing [^"]*"><pre>(?:<[^>]*>)*   panel 57C419', page
    )
    drawing = (
        (ROOT / "config" / "dc_drive" / "README.md").read_text(encoding="utf-8").split("```text\n")[1].split("```")[0]
    )
    assert int(columns) == max(map(len, drawing.splitlines())) > SITE.COLUMNS
    assert "assets/pages.css" in page
    assert "var(--columns)" in (site / "assets" / "pages.css").read_text(encoding="utf-8")


def test_the_pictures_are_of_the_racks_as_they_are():
    """What the terminal shows is made again; `tools/docs_pictures.py` renews it with the others."""
    drawn = (ROOT / "docs" / "pictures" / "screen.svg").read_text(encoding="utf-8")
    assert tool("docs_pictures").screen() == drawn


@pytest.mark.soak
def test_the_pictures_of_report_and_plot_are_made_again(tmp_path):
    """Where another matplotlib draws other bytes, the size is the same."""
    tool("docs_pictures").make(tmp_path)
    for name in ("report.png", "line_report.png", "plot.png", "compare.png"):
        made, committed = (folder.joinpath(name).read_bytes() for folder in (tmp_path, ROOT / "docs" / "pictures"))
        assert made[16:24] == committed[16:24]


def test_links_to_elsewhere_are_whole(site):
    texts = (page.read_text(encoding="utf-8") for page in site.rglob("*.html"))
    for link in {link for text in texts for link in re.findall(r"href=[\"']?(https?:[^\"' >]+)", text)}:
        assert urlsplit(link).hostname, link


def test_it_offers_the_schemas(site):
    for kind in ("rack", "stimuli"):
        assert json.loads((site / "schema" / f"{kind}.schema.json").read_text())["title"].startswith("AutoMax")


def test_a_fence_of_a_page_is_a_block_of_code(site):
    """Words after the language are for tests and titles: a page never shows them as text."""
    for page in site.rglob("*.html"):
        assert "<p>```" not in page.read_text(encoding="utf-8")


def test_a_link_or_anchor_that_leads_nowhere_stops_the_build(tmp_path):
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    with (tmp_path / "docs" / "index.md").open("a") as page:
        page.write("\n[a](nowhere.md), [b](start.md#nowhere), [c](../nowhere.py)\n")
    config = (ROOT / "mkdocs.yml").read_text().replace("tools/docs_site.py", str(ROOT / "tools" / "docs_site.py"))
    (tmp_path / "mkdocs.yml").write_text(config)
    result = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert result.returncode == 1
    for target in ("nowhere.md", "start.md#nowhere", "nowhere.py"):
        assert f"'{target}'" in result.stderr.replace("../", ""), target


@pytest.mark.parametrize(
    ("target", "there"),
    [
        ("../../automax_ros/core/pages/AMX6481.md", "[x](../reference/problems_6.md#amx6481)"),
        ("../../CONTRIBUTING.md", "[x](../contributing.md)"),
        ("../../config/dc_drive", "[x](../examples/dc_drive.md)"),
        ("../../config/dc_drive/rack.yaml", "x"),
        ("../plants.md#feeds", "[x](../plants.md#feeds)"),
        ("../no_such_page.md", "[x](../no_such_page.md)"),
        ("https://example.org/a.md", "[x](https://example.org/a.md)"),
    ],
)
def test_where_links_lead(target, there):
    known = {"plants.md", "contributing.md", "examples/dc_drive.md", "reference/problems_6.md"}
    assert SITE.linked(f"[x]({target})", "docs/howto/io.md", "howto/io.md", known) == there


def test_the_page_of_commands_has_every_option():
    page = PAGES.command_page()
    for command in (inner for found in commands() for inner in found.all()):
        part = page.split(f" automax {' '.join(command.words)}\n", 1)[1].split("\n#", 1)[0]
        for option in command.options:
            assert all(name in part for name in option.names), (command.words, option)
            assert option.text, f"{command.words} {option.names} says nothing of itself"


def test_the_pages_of_problems_have_every_code():
    listed, bands = PAGES.problem_page(), {band: PAGES.problem_band(band) for band in PAGES.BANDS}
    for code, problem in PROBLEMS.items():
        assert f"[{code}](problems_{code[3]}.md#{code.lower()}) | {PAGES.cell(problem.title)} |" in listed
        assert f"{{ #{code.lower()} }}" in bands[code[3]]


def test_the_page_of_messages_has_every_field():
    page = PAGES.message_page()
    for path in sorted([*ROOT.glob("msg_defs/msg/*.msg"), *ROOT.glob("msg_defs/srv/*.srv")]):
        part = page.split(f"### {path.stem}\n")[1].split("\n##")[0]
        lines = [line.partition("#")[0].split() for line in path.read_text().splitlines()]
        for words in (words for words in lines if words and words != ["---"]):
            assert f"| `{words[1].partition('=')[0]}` | `{PAGES.cell(words[0])}` |" in part


def anchors(path: Path) -> set[str]:
    """The anchors of a page, as GitHub makes them of its headings."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    plain = (re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", title) for title in re.findall(r"^#+ (.*)$", text, re.M))
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in plain}


@pytest.mark.parametrize("page", OUTSIDE, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_of_pages_in_the_repository(page):
    for target in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))):
        path, _, anchor = target.partition("#")
        if urlsplit(target).scheme:
            assert urlsplit(target).hostname
            continue
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), target
        if anchor:
            assert anchor in anchors(there), target
