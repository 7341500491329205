"""Writes a YAML tree as text again, so that ``read_yaml`` gives the same tree apart from places; remarks are lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from automax_ros.core.yaml_text import Mapping, Node, Scalar, Sequence

_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_WIDTH = 1 << 20
"""No value is broken over lines."""


def yaml_of(root: Node) -> str:
    """Return a tree as YAML."""
    events = [yaml.StreamStartEvent(), yaml.DocumentStartEvent(explicit=False), *_events(root)]
    events += [yaml.DocumentEndEvent(explicit=False), yaml.StreamEndEvent()]
    text: str = yaml.emit(events, Dumper=_Dumper, width=_WIDTH, allow_unicode=True)
    return text


def _events(node: Node) -> Iterator[yaml.Event]:
    if isinstance(node, Scalar):
        yield _scalar(node)
    elif isinstance(node, Sequence):
        yield yaml.SequenceStartEvent(None, None, True, flow_style=True)
        for item in node.items:
            yield from _events(item)
        yield yaml.SequenceEndEvent()
    else:
        assert isinstance(node, Mapping)
        yield yaml.MappingStartEvent(None, None, True, flow_style=not node.entries)
        for key, value in node.entries:
            yield _scalar(key)
            yield from _events(value)
        yield yaml.MappingEndEvent()


def _scalar(scalar: Scalar) -> yaml.Event:
    if scalar.is_null:
        return yaml.ScalarEvent(None, None, (True, False), "null")
    return yaml.ScalarEvent(
        None, None, (scalar.plain, not scalar.plain), scalar.text, style=None if scalar.plain else '"'
    )
