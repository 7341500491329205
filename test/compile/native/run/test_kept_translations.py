"""Translations in the cache: the same text comes back, and another task has another one."""

from __future__ import annotations

import pytest

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run import task as kept_translations
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import kept_translation, translation_key
from automax_ros.compile.native.translate.translation import scans_of, translate
from compile.support import compiled_of, lines

STATEMENTS = (
    "CALL PROP_INT(INPUT=A%, KP=GAIN, WLD=1.5, OUTPUT=B%)",
    "IF A% > 5 THEN X@ = TRUE",
    "R = R * 0.5 + A%",
)
DECLARED = "LOCAL A%, B%, GAIN, R, X@"


@pytest.fixture
def cache(tmp_path):
    return NativeCache(tmp_path / "cache")


def task(*statements: str, declare: str = DECLARED):
    return compiled_of(lines(*(statements or STATEMENTS), declare=declare))


def key(*statements: str, declare: str = DECLARED) -> str:
    compiled = task(*statements, declare=declare)
    return translation_key(compiled, scans_of(compiled))


def test_a_task_is_translated_once(cache, monkeypatch):
    first = kept_translation(task(), cache)
    assert first == translate(task())
    monkeypatch.setattr(kept_translations, "translated", lambda *_: pytest.fail("translated again"))
    assert kept_translation(task(), cache) == first


def test_a_damaged_text_is_translated_again(cache):
    first = kept_translation(task(), cache)
    (path,) = cache.folder.iterdir()
    content = path.read_bytes()
    for damaged in (content[:-1], b"", b"x" + content[1:]):
        path.write_bytes(damaged)
        assert kept_translation(task(), cache) == first
    assert path.read_bytes() == content


def test_a_text_that_others_can_write_is_refused(cache):
    kept_translation(task(), cache)
    (path,) = cache.folder.iterdir()
    path.chmod(0o622)
    with pytest.raises(NotNative, match="can be written by other users"):
        kept_translation(task(), cache)


def test_what_cannot_be_translated_is_refused_and_not_kept(cache):
    for _ in range(2):
        with pytest.raises(NotNative, match="PRINT"):
            kept_translation(task("PRINT A%"), cache)
    assert not [path for path in cache.folder.iterdir() if path.is_file()]


DIFFERENT = [
    (("R = R * 0.5 + A%",), DECLARED),
    (("R = R * 0.25 + A%",), DECLARED),
    (("R = R * -0.0 + A%",), DECLARED),
    (("R = R * 0.0 + A%",), DECLARED),
    (("CALL PROP_INT(INPUT=A%, KP=2.0, WLD=1.5, OUTPUT=B%)",), DECLARED),
    (("CALL PROP_INT(INPUT=A%, KP=2.0, WLD=1.25, OUTPUT=B%)",), DECLARED),
    (("CALL PROP_INT(INPUT=A%, KP=GAIN, WLD=1.25, OUTPUT=B%)",), DECLARED),
    (("R = R * 0.5 + A%", "A% = 0"), DECLARED),
    (("A% = 0", "R = R * 0.5 + A%"), DECLARED),
    (("R = R * 0.5 + A%",), DECLARED + ", MORE%"),
    (("R = R * 0.5 + A%",), DECLARED + ", MORE!"),
    (("R = R * 0.5 + A%",), DECLARED + ", MORE!(4)"),
    (("R = R * 0.5 + A%",), DECLARED + "\n12 COMMON REF%"),
    (("R = R * 0.5 + A%",), DECLARED + "\n12 COMMON REF!"),
]


def test_whatever_makes_another_text_has_another_key():
    keys = [key(*statements, declare=declared) for statements, declared in DIFFERENT]
    assert len(set(keys)) == len(DIFFERENT)
    assert keys == [key(*statements, declare=declared) for statements, declared in DIFFERENT]


def test_sources_and_python_are_part_of_the_key(monkeypatch):
    before = key()
    monkeypatch.setattr(kept_translations, "_TRANSLATOR", ("other sources",))
    assert key() != before
