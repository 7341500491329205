"""Reads the problem pages: title, text, example and cure with what their fences say of target and rack."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import automax_ros.core
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.ticks import tick_ns
from automax_ros.core.types import DataType, type_of_name
from automax_ros.language.program import CommonSpec

PAGES = Path(automax_ros.core.__file__).parent / "pages"
_FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_COMMON = re.compile(r"(\w+[%!@$]?)(?:\((\d+)\))?(:in)?$")


@dataclass(frozen=True)
class Fence:
    """A fenced text of a page: its language and the words after it, such as ``target=udc`` or ``rack=RUN@:in``."""

    language: str
    words: tuple[str, ...]
    text: str

    @property
    def target(self) -> Platform:
        return Platform(self._word("target") or "automax")

    @property
    def tick_ns(self) -> int:
        return tick_ns(self._word("tick_ms") or (0.5 if self.target is Platform.UDC else 5.5))

    @property
    def commons(self) -> dict[str, CommonSpec] | None:
        definitions = self._word("rack")
        if definitions is None:
            return None
        found = [_COMMON.match(item) for item in definitions.split(";")]
        specs = [_common(*match.groups()) for match in found if match]
        return {spec.name: spec for spec in specs}

    def _word(self, key: str) -> str | None:
        return next((word.partition("=")[2] for word in self.words if word.startswith(f"{key}=")), None)


def _common(name: str, subscript: str | None, is_input: str | None) -> CommonSpec:
    kind = type_of_name(name)
    dimensions = () if subscript is None else (int(subscript) + 1,)
    length = 31 if kind is DataType.STRING else 0
    return CommonSpec(name, kind, "rack.yaml:14", dimensions, length, is_input is not None)


@dataclass(frozen=True)
class Page:
    title: str
    text: str
    example: Fence
    cure: Fence


def read_page(code: str) -> Page:
    """Return a page; fails where it does not have the form that all pages have."""
    content = (PAGES / f"{code}.md").read_text(encoding="utf-8")
    head, example, cure = re.split(r"^## (?:Example|Cure)$", content, flags=re.MULTILINE)
    assert content.index("## Example") < content.index("## Cure")
    title, _, text = head.partition("\n")
    fences = []
    for part in (example, cure):
        found = _FENCE.findall(part)
        assert len(found) == 1, f"{code}: one fenced text in Example, one in Cure"
        language, words, body = found[0]
        fences.append(Fence(language, tuple(words.split()), body))
    return Page(title, text.strip(), *fences)
