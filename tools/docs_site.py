"""Hooks of mkdocs for building the site: add the generated pages and those from outside of docs/, and adapt links.

A page may link to any file of the repository, so that links work when it is read there. In the site such a link leads
to the page that shows the file; where there is none, only the link's text remains.
"""

from __future__ import annotations

import html
import posixpath
import re
from typing import TYPE_CHECKING

from docs_pages import BANDS, ROOT, pages

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

FROM_ELSEWHERE = {
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "examples/README.md": "examples/robots.md",
    **{
        path.relative_to(ROOT).as_posix(): f"examples/{path.parent.name}.md"
        for path in sorted((ROOT / "config").glob("*/README.md"))
    },
}
"""Pages outside of docs/, by their path, with their place in the site."""
LINK = re.compile(r"(?<!!)\[(?P<text>[^\]]*)\]\((?P<target>[^)\s]+)\)")
FENCE = re.compile(r"^```(?P<language>\w+)(?: (?P<file>\w+\.\w+))?[^\n`]*$", re.MULTILINE)
"""The head of a fence: its language, and the file that it shows or data for its test."""
CODE = re.compile(r"(^```.*?^```$|`[^`\n]*`)", re.MULTILINE | re.DOTALL)
TEXT = re.compile(r'(?P<head><div class="(?:language-text )?highlight">)(?P<text><pre>.*?</pre>)', re.DOTALL)
TAG = re.compile(r"<[^>]*>")
COLUMNS = 88
"""Characters of code in a line of the text column on a usual screen."""
PROBLEM = re.compile(r"automax_ros/core/pages/(AMX(\d)\d+)\.md")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not in docs/."""
    from mkdocs.structure.files import File

    for place, text in pages().items():
        files.append(File.generated(config, place, content=text))
    for source, place in FROM_ELSEWHERE.items():
        files.append(File.generated(config, place, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, *, page: Page, files: Files, **_: object) -> str:
    """Reduce the head of a fence to its language and file, and point links to the places in the site."""
    place = page.file.src_uri
    source = next((path for path, there in FROM_ELSEWHERE.items() if there == place), f"docs/{place}")
    known = {file.src_uri for file in files}
    parts = CODE.split(markdown)
    text = (part if index % 2 else linked(part, source, place, known) for index, part in enumerate(parts))
    return FENCE.sub(headed, "".join(text))


def on_page_content(content: str, **_: object) -> str:
    """Make drawings and other wide blocks of text fit into the column (docs/assets/pages.css)."""
    return TEXT.sub(fitted, content)


def fitted(match: re.Match[str]) -> str:
    """Return a block of text; one wider than the column gets the number of its columns."""
    columns = max(len(line) for line in html.unescape(TAG.sub("", match["text"])).splitlines() or [""])
    head = match["head"]
    if columns > COLUMNS:
        head = head.replace('<div class="', f'<div style="--columns: {columns}" class="drawing ')
    return head + match["text"]


def headed(match: re.Match[str]) -> str:
    """Return the head of a fence for the site, with the name of its file as a title."""
    return f"```{match['language']}" + (f' title="{match["file"]}"' if match["file"] else "")


def linked(text: str, source: str, place: str, known: set[str]) -> str:
    """Return a text whose links to files of the repository lead to pages of the site.

    ``source`` is the path of the page in the repository, ``place`` that in the site, ``known`` are the site's files.
    """

    def mended(match: re.Match[str]) -> str:
        target, mark, anchor = match["target"].partition("#")
        if not target or "://" in target or target.startswith("mailto:"):
            return match[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
        there, own_anchor = site_place(path)
        if there is None or there not in known:
            # A page that should exist: mkdocs reports the link.
            return match[0] if path.startswith("docs/") or not (ROOT / path).exists() else match["text"]
        relative = posixpath.relpath(there, posixpath.dirname(place) or ".")
        return f"[{match['text']}]({relative}{own_anchor or mark + anchor})"

    return LINK.sub(mended, text)


def site_place(path: str) -> tuple[str | None, str]:
    """Return the place of a repository file in the site, None if it has none, and the anchor there or ""."""
    if path in FROM_ELSEWHERE:
        return FROM_ELSEWHERE[path], ""
    problem = PROBLEM.fullmatch(path)
    if problem is not None and problem[2] in BANDS:
        return f"reference/problems_{problem[2]}.md", f"#{problem[1].lower()}"
    folder = f"{path}/README.md"
    if folder in FROM_ELSEWHERE:
        return FROM_ELSEWHERE[folder], ""
    return (path.removeprefix("docs/"), "") if path.startswith("docs/") else (None, "")
