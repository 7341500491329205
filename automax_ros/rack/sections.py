"""Mappings of a rack file: known keys, each once, and none missing."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from collections.abc import Mapping as AbstractMapping

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.yaml_text import Mapping, Node, Scalar
from automax_ros.rack.findings import Findings
from automax_ros.rack.scalars import wrong_kind

Entry = tuple[Scalar, Node]


def entries_of(node: Node, what: str, findings: Findings) -> tuple[Entry, ...] | None:
    """Return keys and values, () for a key without a value; None (reported) where something else stands."""
    if isinstance(node, Mapping):
        return node.entries
    if isinstance(node, Scalar) and node.is_null:
        return ()
    wrong_kind(node, what, "keys and values", findings)
    return None


class Section:
    """A mapping whose keys have fixed names.

    Reports AMX6006 a key twice and AMX6007 a key that is not known.
    """

    def __init__(
        self,
        entries: Iterable[Entry],
        what: str,
        known: Collection[str],
        findings: Findings,
        hints: AbstractMapping[str, str] | None = None,
    ) -> None:
        """Sort the entries; ``what`` names the section in messages, ``known`` are its keys.

        ``hints`` say of keys that people look for what does their work.
        """
        self._values: dict[str, Entry] = {}
        for key, value in entries:
            if key.text not in known:
                hint = (hints or {}).get(key.text) or did_you_mean(key.text, known)
                hint = hint or f"{what} has the keys {', '.join(known)}"
                findings.add("AMX6007", f"{what} has no key {quoted(key.text)}", key.span, hint)
            elif key.text in self._values:
                report_twice(key, f"key {quoted(key.text)} of {what}", self._values[key.text][0].span, findings)
            else:
                self._values[key.text] = (key, value)

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def get(self, key: str) -> Node | None:
        """Return the value of a key, None where the file does not have it."""
        entry = self._values.get(key)
        return entry[1] if entry else None

    def key_span(self, key: str) -> Span:
        """Return the place of a key that the section has."""
        return self._values[key][0].span

    def require(self, keys: Iterable[str], what: str, span: Span, findings: Findings) -> bool:
        """Report AMX6009 if keys are missing; return whether all are there."""
        missing = [key for key in keys if key not in self._values]
        if missing:
            word = "key" if len(missing) == 1 else "keys"
            names = ", ".join(quoted(key) for key in missing)
            findings.add("AMX6009", f"{what} lacks the {word} {names}", span)
        return not missing


def report_twice(key: Scalar, what: str, first: Span, findings: Findings, code: str = "AMX6006") -> None:
    """Report that something is defined a second time."""
    notes = (Note("first defined here", first),)
    findings.add(code, f"{what} is already defined in line {first.line}", key.span, notes=notes)
