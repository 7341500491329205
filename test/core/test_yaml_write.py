"""A YAML tree written as text is read as the same tree."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.diagnostics import Span
from automax_ros.core.text import printable
from automax_ros.core.yaml_text import Node, Scalar, YamlMapping, YamlSequence, flow_text, read_data, read_yaml, yaml_of

CONFIGS = sorted((Path(__file__).parents[2] / "config").glob("**/*.yaml"))
HERE = Span(1, 1, 2)


@dataclass(frozen=True)
class _Null:
    """Nothing, however it was spelled."""


def bare(node: Node) -> object:
    """Return a tree without places."""
    if isinstance(node, YamlMapping):
        return [(bare(key), bare(value)) for key, value in node.entries]
    if isinstance(node, YamlSequence):
        return tuple(map(bare, node.items))
    return _Null() if node.is_null else (node.text, node.plain)


def read(text: str) -> Node:
    flaws: list[str] = []
    root = read_yaml(text, lambda _, message, *__: flaws.append(message))
    assert root is not None
    assert not flaws
    return root


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_files_of_racks_and_stimuli_stay_what_they_say(path: Path):
    root = read(path.read_text(encoding="utf-8"))
    assert bare(read(yaml_of(root))) == bare(root)


TEXTS = st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "S", "Zs")), max_size=20)
QUOTED = TEXTS.map(lambda text: Scalar(text, False, HERE))
PLAIN = st.from_regex(r"-?[0-9]{1,5}(\.[0-9]{1,3})?|[A-Za-z][A-Za-z0-9_]{0,8}[%@!]?", fullmatch=True).map(
    lambda text: Scalar(text, True, HERE)
)
SCALARS = QUOTED | PLAIN | st.just(Scalar("", True, HERE))
TREES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: YamlSequence(tuple(items), HERE))
        | st.lists(st.tuples(PLAIN | QUOTED, inner), max_size=3).map(lambda items: YamlMapping(tuple(items), HERE))
    ),
    max_leaves=12,
)


@given(TREES)
def test_any_tree_stays_what_it_is(root: Node):
    assert bare(read(yaml_of(root))) == bare(root)


@given(st.text(max_size=12).map(printable) | st.sampled_from(("", "NULL", "no", "A: B", "A #B", "- A", "A ", "it's")))
@settings(max_examples=300, deadline=None, derandomize=True, database=None)
def test_any_printable_line_is_a_value_in_a_flow_mapping(text):
    assert read_data(f"a: {{b: {flow_text(text)}, c: 1}} # {text}\n") == {"a": {"b": text, "c": "1"}}


@pytest.mark.parametrize("text", ["PAPER", "LINE 1/2 (OLD)", "A.BAS"])
def test_plain_words_need_no_quotes(text):
    assert flow_text(text) == text
