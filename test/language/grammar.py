"""The grammar of docs/grammar.md, read from the page: a recognizer of token lists, and texts made from it at random."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from random import Random

from automax_ros.language.parse.unknown import FOREIGN_WORDS
from automax_ros.language.text.tokens import BASIC_TASK_WORDS, RESERVED_WORDS
from automax_ros.language.tree.functions import FUNCTIONS, REFUSED_FUNCTIONS

PAGE = Path(__file__).parents[2] / "docs" / "grammar.md"
END_OF_LINE = "\n"
_SYMBOL = re.compile(r'\s*(?:"([^"]*)"|([a-z][a-z -]*[a-z])|([=,|;{}()\[\]]))')
OTHER_ANSWERS = BASIC_TASK_WORDS.keys() | FOREIGN_WORDS.keys() | REFUSED_FUNCTIONS.keys()
"""Words that are not part of the language and get a hint of their own where they begin a statement."""


@dataclass(frozen=True)
class Node:
    """A part of a rule: ``kind`` is word, name, all, one, maybe or many."""

    kind: str
    text: str = ""
    parts: tuple[Node, ...] = ()


class _Reader:
    def __init__(self, text: str) -> None:
        self._symbols = _SYMBOL.findall(text)
        self._at = 0

    def rules(self) -> dict[str, Node]:
        found = {}
        while self._at < len(self._symbols):
            name = self._next()[1]
            assert name not in found
            assert self._next()[2] == "="
            found[name] = self._choice()
            assert self._next()[2] == ";"
        return found

    def _next(self) -> tuple[str, str, str]:
        self._at += 1
        return self._symbols[self._at - 1]

    def _mark(self) -> str:
        return self._symbols[self._at][2]

    def _choice(self) -> Node:
        parts = [self._sequence()]
        while self._mark() == "|":
            self._next()
            parts.append(self._sequence())
        return parts[0] if len(parts) == 1 else Node("one", parts=tuple(parts))

    def _sequence(self) -> Node:
        parts = [self._item()]
        while self._mark() == ",":
            self._next()
            parts.append(self._item())
        return parts[0] if len(parts) == 1 else Node("all", parts=tuple(parts))

    def _item(self) -> Node:
        word, name, mark = self._next()
        if name:
            return Node("name", name)
        if not mark:
            return Node("word", word)
        inner = self._choice()
        assert self._next()[2] == {"[": "]", "{": "}", "(": ")"}[mark]
        return inner if mark == "(" else Node("maybe" if mark == "[" else "many", parts=(inner,))


def _rules() -> dict[str, Node]:
    text = PAGE.read_text(encoding="utf-8")
    return _Reader("\n".join(re.findall(r"```ebnf\n(.*?)```", text, re.DOTALL))).rules()


def _tokens() -> dict[str, str]:
    rows = re.findall(r"^\| ([a-z ]+) \| `(.*?)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: pattern.replace(r"\|", "|") for name, pattern in rows if name != "token"}


RULES, TOKENS = _rules(), _tokens()


def words(node: Node | None = None) -> set[str]:
    """All words in quotes, of a part or of the whole grammar."""
    if node is None:
        return set().union(*map(words, RULES.values()))
    return {node.text} if node.kind == "word" else set().union(*map(words, node.parts))


def is_token(kind: str, text: str) -> bool:
    if re.fullmatch(TOKENS[kind], text) is None:
        return False
    if kind == "decimal":
        return int(text) <= 2**31
    if kind == "hexadecimal":
        return len(text[:-1].lstrip("0")) <= 8
    if kind == "event name":
        return text not in RESERVED_WORDS
    return not kind.endswith(" name") or text not in RESERVED_WORDS | FUNCTIONS.keys() | REFUSED_FUNCTIONS.keys()


class Recognizer:
    """Whether a list of tokens is what a rule describes; every way to read it is followed."""

    def __init__(self, tokens: list[str]) -> None:
        self._tokens = tokens
        self._ends: dict[tuple[str, int], frozenset[int]] = {}

    def accepts(self, rule: str) -> bool:
        return len(self._tokens) in self._rule(rule, 0)

    def _rule(self, name: str, at: int) -> frozenset[int]:
        if (name, at) not in self._ends:
            self._ends[name, at] = frozenset(self._node(RULES[name], at)) if name in RULES else self._token(name, at)
        return self._ends[name, at]

    def _token(self, kind: str, at: int) -> frozenset[int]:
        there = at < len(self._tokens) and is_token(kind, self._tokens[at])
        return frozenset({at + 1} if there else ())

    def _node(self, node: Node, at: int) -> set[int]:
        if node.kind == "word":
            return {at + 1} if at < len(self._tokens) and self._tokens[at] == node.text else set()
        if node.kind == "name":
            return set(self._rule(node.text, at))
        if node.kind == "one":
            return set().union(*(self._node(part, at) for part in node.parts))
        ends = {at}
        if node.kind == "all":
            for part in node.parts:
                ends = set().union(*(self._node(part, end) for end in ends))
            return ends
        new = ends
        while new:
            new = set().union(*(self._node(node.parts[0], end) for end in new)) - ends
            ends = ends | new
            if node.kind == "maybe":
                break
        return ends


_NAMES = ["A", "_X1", "SPEED_REF", "B2", "ABCDEFGHIJKLMNOP"]
SAMPLES = {
    "decimal": ["0", "7", "007", "32767", "65535", "2147483648"],
    "hexadecimal": ["0H", "0FFH", "7FFFH", "0012ABCDH"],
    "real": ["1.", "0.5", ".25", "1234.5678", "120E3", "5E-3", "1E+9"],
    "string": ['""', "''", '"IT\'S"', "'A \\ B'", "'! REM'"],
    "word": [*_NAMES, "LAG", "INPUT", "IF", "TO"],
    "number name": [name + mark for name in _NAMES for mark in ("", "%", "!", "@")],
    "string name": [name + "$" for name in _NAMES],
    "event name": [*_NAMES, "ABS"],
    "remark text": ["", "TEXT", "A% = 'OPEN", "! = \\ ((("],
}
"""What a text of the grammar has for each token."""
NESTING = ("line", "branch", "expression")
DEEPEST = 3
"""Most of the nesting rules inside each other; deeper only the shortest way out is taken."""


def _shortest() -> dict[str, int]:
    """The least number of nested rules that each rule needs: 0 for tokens."""
    least = dict.fromkeys(RULES, 1000)

    def of(node: Node) -> int:
        if node.kind in ("word", "maybe", "many"):
            return 0
        if node.kind == "name":
            return least.get(node.text, -1) + 1
        return (min if node.kind == "one" else max)(of(part) for part in node.parts)

    for _ in RULES:
        least = {name: of(rule) for name, rule in RULES.items()}
    return least


_LEAST = _shortest()


def _need(node: Node) -> int:
    if node.kind == "name":
        return _LEAST.get(node.text, -1) + 1
    if node.kind in ("one", "all"):
        return (min if node.kind == "one" else max)(map(_need, node.parts))
    return 0


def has_a_key_twice(tokens: list[str]) -> bool:
    """Of an EVENT or a tunable: the page's text rules it out."""
    keys = [word for word, sign in pairwise(tokens) if sign == "="]
    return len(set(keys)) < len(keys)


class _Writer:
    """Draws a list of tokens; keys that may be given once are not repeated, NEXT names the variable of its FOR."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self.tokens: list[str] = []
        self._number = 0

    def write(self, name: str, depth: int = 0) -> None:
        if name == "end of line":
            self.tokens.append(END_OF_LINE)
        elif name == "line number":
            if self.tokens and self.tokens[-1] != END_OF_LINE:
                self.tokens.append(END_OF_LINE)
            self._number += self._random.randint(1, 9)
            self.tokens.append(str(self._number))
        elif name in TOKENS:
            self.tokens.append(self._random.choice(SAMPLES[name]))
        else:
            start = len(self.tokens)
            self._node(RULES[name], depth + (name in NESTING))
            while name in ("event", "tunable") and has_a_key_twice(self.tokens[start:]):
                del self.tokens[start:]
                self._node(RULES[name], depth)
            if name == "for block":
                self.tokens[-1] = self.tokens[start + 1]

    def _node(self, node: Node, depth: int) -> None:
        deep = depth > DEEPEST
        if node.kind == "word":
            self.tokens.append(node.text)
        elif node.kind == "name":
            self.write(node.text, depth)
        elif node.kind == "all":
            for part in node.parts:
                self._node(part, depth)
        elif node.kind == "one":
            least = min(map(_need, node.parts))
            ways = [part for part in node.parts if not deep or _need(part) == least]
            self._node(self._random.choice(ways), depth)
        else:
            most = 1 if node.kind == "maybe" else 4
            chance = 0.8 if depth == 0 else 0.2
            for _ in range(most):
                if deep or self._random.random() > chance:
                    break
                self._node(node.parts[0], depth)


def tokens_of(rule: str, random: Random) -> list[str]:
    writer = _Writer(random)
    writer.write(rule)
    return writer.tokens


def text_of(tokens: list[str]) -> str:
    return re.sub(r" *\n *", "\n", " ".join(tokens))
