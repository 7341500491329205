"""YAML as data, bounded; test/rackfile/reading/test_rack_yaml.py has the places."""

import string

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core import yaml_text
from automax_ros.core.yaml_text import Flaw, YamlFault, read_data, read_yaml


def test_values_are_texts_unless_types_are_asked_for():
    text = "a: 1\nb: [true, no, 57E413, '2', 010]\nc: {x: -3}\na: 5\n"
    assert read_data(text) == {"a": "5", "b": ["true", "no", "57E413", "2", "010"], "c": {"x": "-3"}}
    assert read_data(text, typed=True) == {"a": 5, "b": [True, "no", "57E413", "2", "010"], "c": {"x": -3}}


@pytest.mark.parametrize(
    ("text", "flaw", "message"),
    [
        ("a: [1", Flaw.SYNTAX, "line 1: "),
        ("a: \x00", Flaw.SYNTAX, r"line 1: character U\+0000 is not allowed"),
        ("\na: &x [1]\nb: *x\n", Flaw.EXTRA, "line 2: the anchor '&x' is not allowed"),
        ("b: *x\n", Flaw.EXTRA, "the alias"),
        ("a: !!python/object/apply:os.system [ls]", Flaw.EXTRA, "the tag"),
        ("<<: {a: 1}", Flaw.EXTRA, "merge key"),
        ("[1]: 2", Flaw.EXTRA, "a key must be a single word"),
        ("a: 1\n---\nb: 1\n", Flaw.EXTRA, "a second document"),
        ("[" * 100, Flaw.SIZE, "nested deeper than 16 levels"),
        ("- 1\n" * 100_001, Flaw.SIZE, "more than 100000 keys and values"),
    ],
)
def test_what_is_not_read_is_refused(text, flaw, message):
    with pytest.raises(YamlFault, match=message) as caught:
        read_data(text)
    assert caught.value.flaw is flaw


@settings(deadline=None, derandomize=True, max_examples=300)
@given(text=st.text(string.ascii_letters[:4] + "0: \n\t-[]{},'\"#|>%&*!?\r\xe9\x85", max_size=60))
def test_libyaml_and_pyyaml_read_the_same_tree(text):
    trees = []
    for loader in (yaml.SafeLoader, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        found = []
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(yaml_text, "_Loader", loader)
            root = read_yaml(text, lambda *flaw: found.append(flaw))  # noqa: B023
        trees.append(None if found else root)
    if None not in trees:
        assert trees[0] == trees[1]
