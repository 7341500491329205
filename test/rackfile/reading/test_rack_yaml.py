"""YAML as rack files use it: what is refused, where, and that nothing breaks the reader."""

import time

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from rack.helpers import HEAD, codes, loaded, write

from automax_ros.core.diagnostics import render_all
from automax_ros.core.yaml_text import MAX_DEPTH, Node, Scalar, YamlMapping, read_yaml
from automax_ros.rackfile.loader import LoadResult, load
from automax_ros.rackfile.reading.files import MAX_BYTES
from automax_ros.rackfile.reading.values import MAX_FINDINGS, ProblemList

PROPERTY = settings(deadline=None, derandomize=True, database=None, max_examples=300)

WHOLE_RACK = """\
rack: LINE1
operator: false
slots:
  0: {module: 57C413}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      LINE: {file: LINE.BLK, priority: 5}
common:
  SPEED%: {ros: out, unit: fpm, rate_limit_hz: 20}
  TABLE%(3): {preset: [1, 2, 3, 4], non_volatile: true}
  TEXT$:50: {preset: "a b", description: 'it''s'}
"""


def places(text: str) -> list[tuple[str, int, int, int]]:
    findings = ProblemList()
    read_yaml(text, findings.yaml_flaw)
    return [(item.code, item.span.line, item.span.column, item.span.end_column) for item in findings.in_order()]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("a: 1\nb: [1, 2\n", ("AMX6003", 3, 1)),
        ("a: 1\n\tb: 2\n", ("AMX6003", 2, 1)),
        ("a: %b\n", ("AMX6003", 1, 4)),
        ("@a: 1\n", ("AMX6003", 1, 1)),
        ("a: 'b\n", ("AMX6003", 2, 1)),
        ("a: b\x07\n", ("AMX6003", 1, 5)),
        ("a: b: c\n", ("AMX6003", 1, 5)),
        ("a: 1\nb: &x 1\n", ("AMX6004", 2, 4)),
        ("a: !!python/object:os.system x\n", ("AMX6004", 1, 4)),
        ("a: ! x\n", ("AMX6004", 1, 4)),
        ("<<: {a: 1}\n", ("AMX6004", 1, 1)),
        ("? [a]\n: 1\n", ("AMX6004", 1, 3)),
        ("a: 1\n--- \nb: 1\n", ("AMX6004", 2, 1)),
        ("a: '\u2028'\nb: &x 1\n", ("AMX6004", 2, 4)),
    ],
)
def test_place_of_what_is_refused(text, place):
    assert [item[:3] for item in places(text)] == [place]


def test_nesting_is_bounded():
    assert places("[" * MAX_DEPTH + "]" * MAX_DEPTH) == []
    assert places("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1)) == [("AMX6005", 1, MAX_DEPTH + 1, MAX_DEPTH + 2)]


def test_alias_is_reported_once_and_only_as_such(tmp_path):
    text = "rack: A\nslots:\n  0: {module: &m 57C413}\n  1: {module: *m}\n"
    assert codes(tmp_path, text) == ["AMX6004", "AMX6004"]


def plain(node: Node) -> object:
    """What PyYAML's loader of plain texts makes of the same."""
    if isinstance(node, Scalar):
        return node.text
    if isinstance(node, YamlMapping):
        return {key.text: plain(value) for key, value in node.entries}
    return [plain(item) for item in node.items]


WORDS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn")), max_size=12)
TREES = st.recursive(
    WORDS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(WORDS, inner, max_size=4), max_leaves=20
)


@PROPERTY
@given(TREES, st.booleans())
def test_trees_come_back_as_yaml_wrote_them(tree, flow):
    """An independent writer, PyYAML's emitter, and the reader agree."""
    text = yaml.safe_dump(tree, default_flow_style=flow, allow_unicode=True)
    findings = ProblemList()
    node = read_yaml(text, findings.yaml_flaw)
    if findings.errors:
        allowed = {"AMX6005"} | ({"AMX6004"} if "<<" in text else set())
        assert {item.code for item in findings.in_order()} <= allowed
    else:
        assert plain(node) == tree


def survives(folder, text: str) -> LoadResult:
    """Loading gives diagnostics inside the text or a rack, and everything can be rendered."""
    path = folder / "rack.yaml"
    path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
    result = load(path)
    assert (result.config is None) == any(item.severity.value == "error" for item in result.diagnostics)
    for item in result.diagnostics:
        assert 1 <= item.span.line <= len(result.source.lines)
        assert 1 <= item.span.column < item.span.end_column
        assert item.span.column <= len(result.source.lines[item.span.line - 1]) + 1
        assert "\n" not in item.message
    rendered = render_all(result.diagnostics, result.source)
    assert all(char.isprintable() or char in "\n\t" for char in rendered)
    return result


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("racks")
    write(path, HEAD)
    return path


@PROPERTY
@given(text=st.text(max_size=200))
def test_any_text_gives_diagnostics_never_an_exception(folder, text):
    survives(folder, text)


@PROPERTY
@given(text=st.text(alphabet="ab:{}[]%@!$&*<>|-?#'\"\\ \n\t,057C435\x00\x85\u2028\ud800", max_size=120))
def test_texts_of_yaml_marks_give_diagnostics(folder, text):
    survives(folder, text)


@st.composite
def mutations(draw: st.DrawFn) -> str:
    text = WHOLE_RACK
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 12)))
        pieces = [
            draw(st.sampled_from(["", " ", "\n", "[", "{", "&a ", "*a", "!x ", "<<: ", "-1", "\x00", "~", "'", ": "]))
        ]
        lines = text.splitlines(keepends=True)
        pieces.append(draw(st.sampled_from(["", *lines])))
        text = text[:start] + "".join(pieces) + text[end:]
    return text


@PROPERTY
@given(text=mutations())
def test_mutated_racks_give_diagnostics(folder, text):
    survives(folder, text)


@PROPERTY
@given(
    values=st.lists(st.sampled_from(["rack", "slots", "common", "0", "1", "module", "A%", "57C435"]), max_size=8),
    tree=TREES,
)
def test_any_tree_in_any_place_gives_diagnostics(folder, values, tree):
    for key in reversed(values):
        tree = {key: tree}
    survives(folder, yaml.safe_dump(tree, allow_unicode=True))


HOSTILE = {
    "brackets": "[" * MAX_BYTES,
    "braces": "{a: " * (MAX_BYTES // 4),
    "dashes": "- " * (MAX_BYTES // 2),
    "questions": "? " * (MAX_BYTES // 2),
    "empty lists": "[" + "[]," * (MAX_BYTES // 3 - 1) + "]",
    "one word": "a" * MAX_BYTES,
    "one key": HEAD + "common: {" + "A" * (MAX_BYTES // 2) + ": }",
    "many keys": HEAD + "common:\n" + "".join(f"  V{number}%:\n" for number in range(49_000)),
    "unknown keys": HEAD + "".join(f"slot{number}: 0\n" for number in range(49_000)),
    "same slot": "rack: A\nslots:\n" + "  0: {}\n" * 49_000,
    "many tasks": HEAD.replace("{priority: 5}}}", "") + "{" + "a: 1, " * 49_000 + "}}}",
    "long preset": HEAD + "common:\n  A$: {preset: '" + "x" * (MAX_BYTES // 2) + "'}\n",
    "digits": HEAD + "common:\n  A%: {preset: " + "9" * (MAX_BYTES // 2) + "}\n",
    "subscripts": HEAD + "common:\n  A%(" + "9," * (MAX_BYTES // 4) + "9):\n",
    "quotes": HEAD + "common: {'" + "''" * (MAX_BYTES // 4) + "': }\n",
    "anchors": "".join(f"a{number}: &x{number} [*x{number}]\n" for number in range(30_000)),
    "blank lines": "\n" * MAX_BYTES,
    "wide list": HEAD + "common:\n  A%(9): {preset: [" + "1," * 99_000 + "1]}\n",
}
SLOW = {"same slot", "many tasks", "unknown keys", "anchors", "many keys"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.soak if name in SLOW else ()) for name in HOSTILE]
)
def test_hostile_files_end_in_seconds_with_few_diagnostics(folder, name):
    text = HOSTILE[name][:MAX_BYTES]
    began = time.process_time()
    assert len(survives(folder, text).diagnostics) <= 2 * MAX_FINDINGS
    assert time.process_time() - began < 60


def test_file_of_exactly_the_largest_size_is_read(tmp_path):
    text = HEAD + "#" * (MAX_BYTES - len(HEAD))
    assert loaded(tmp_path, text).diagnostics == []
    assert codes(tmp_path, text + "#") == ["AMX6001"]


@pytest.mark.parametrize(
    ("data", "column"), [(b"\xff\xfe", 1), (b"rack: \xfcbel\n", 7), (b"\xef\xbb\xbfa: \xe2\x82", 4)]
)
def test_place_of_the_first_byte_that_is_not_utf_8(tmp_path, data, column):
    path = tmp_path / "rack.yaml"
    path.write_bytes(data)
    assert [(item.code, item.span.line, item.span.column) for item in load(path).diagnostics] == [
        ("AMX6002", 1, column)
    ]
