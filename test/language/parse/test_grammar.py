"""docs/grammar.md and the parser say the same: what the page allows is read, all else refused, no word is missing."""

import re
from itertools import pairwise
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soaking import in_soak

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.language.parse.basic_statements import ACCESSES, WAITING_STATEMENTS
from automax_ros.language.parse.declarations import EVENT_KEYS, TUNING_KEYS
from automax_ros.language.parse.expressions import LEVELS
from automax_ros.language.parse.parser import parse
from automax_ros.language.parse.statements import SIMPLE_STATEMENTS
from automax_ros.language.parse.unknown import FOREIGN_WORDS
from automax_ros.language.text.lexer import LineLexer
from automax_ros.language.text.tokens import BOOLEAN_WORDS, OPERATOR_WORDS, RESERVED_WORDS, STATEMENT_WORDS
from automax_ros.language.tree.functions import FUNCTIONS
from automax_ros.language.tree.tree import ITEM_TYPES, Unit
from language.grammar import (
    OTHER_ANSWERS,
    RULES,
    TOKENS,
    Recognizer,
    has_a_key_twice,
    is_token,
    text_of,
    tokens_of,
    words,
)

WAITING = "task statement"
STATEMENTS = ("simple statement", "one-line if")
WAITING_KEYS = {
    *("EVERY", "CHANNEL", "AS", "FILE", "TYPE", "DEPTH", "SETUP", "ACCESS", "EMPTY", "FULL"),
    *(*ACCESSES, *ITEM_TYPES, *(unit.value for unit in Unit)),
}
"""Words inside the statements that wait; none is reserved."""


def repeatable(examples: int) -> settings:
    return settings(max_examples=examples, deadline=None, derandomize=True, database=None)


def errors(text: str, name: str = "TASK.BLK") -> list[str]:
    found = parse(SourceText(name, text))[1]
    return [item.message for item in found if PROBLEMS[item.code].severity is Severity.ERROR]


def is_word(text: str) -> bool:
    return text[0].isalpha()


def test_every_word_of_the_parser_stands_in_the_grammar_and_no_other() -> None:
    reserved = STATEMENT_WORDS | OPERATOR_WORDS | BOOLEAN_WORDS.keys() | {"THEN", "TO", "STEP"}
    assert reserved == RESERVED_WORDS
    keys = {
        *EVENT_KEYS,
        *TUNING_KEYS,
        "NAME",
        "SET",
        *WAITING_STATEMENTS,
        *WAITING_KEYS,
        *ITEM_TYPES,
        *(unit.value for unit in Unit),
        "OUTPUT",
    }
    assert {word for word in words() if is_word(word)} == reserved | FUNCTIONS.keys() | keys
    assert SIMPLE_STATEMENTS.keys() | WAITING_STATEMENTS.keys() <= words()


def test_every_operator_and_mark_stands_in_the_grammar() -> None:
    signs = {word for word in words() if not is_word(word)}
    assert {operator for operator in LEVELS if not is_word(operator)} <= signs
    assert signs - LEVELS.keys() == set("()[],;:!\\#")


def test_every_rule_and_token_is_used_and_known() -> None:
    used = {"task", "task statement", *TOKENS, "end of line"}
    waiting = [*RULES.values()]
    named = {"task", "task statement"}
    while waiting:
        node = waiting.pop()
        waiting += node.parts
        if node.kind == "name":
            named.add(node.text)
    assert named == (used | RULES.keys())


@pytest.mark.parametrize("number", [200, in_soak(20_000)])
def test_every_task_of_the_grammar_is_read(number: int) -> None:
    for seed in range(number):
        text = text_of(tokens_of("task", Random(seed)))
        assert errors(text) == [], text


@pytest.mark.parametrize("rule", STATEMENTS)
def test_the_recognizer_knows_what_the_grammar_makes(rule: str) -> None:
    for seed in range(200):
        tokens = tokens_of(rule, Random(seed))
        assert Recognizer(tokens).accepts("statement"), tokens


@pytest.mark.parametrize("kind", [kind for kind in TOKENS if kind not in ("line number", "remark text")])
def test_tokens_are_those_of_the_lexer(kind: str) -> None:
    @given(text=st.from_regex(re.compile(TOKENS[kind]), fullmatch=True).filter(lambda text: is_token(kind, text)))
    @repeatable(40)
    def one_token_without_fault(text: str) -> None:
        found = LineLexer().tokens(text, 1, 0, 0)
        assert [(token.text, token.fault) for token in found] == [(text, None)]

    one_token_without_fault()


OTHERS = [*sorted(words() - {"!", "REM"}), "5", "1.5", "0FFH", "'TEXT'", "A", "A%", "A$"]


def near_miss(random: Random, rules: tuple[str, ...] = STATEMENTS) -> list[str]:
    """A statement with a token left out, repeated, exchanged with the next or replaced by another."""
    tokens = tokens_of(random.choice(rules), random)
    at = random.randrange(len(tokens))
    way = random.choice(["left out", "repeated", "exchanged", "replaced"])
    if way == "left out":
        del tokens[at]
    elif way == "repeated":
        tokens.insert(at, tokens[at])
    elif way == "exchanged":
        tokens[at : at + 2] = tokens[at : at + 2][::-1]
    else:
        tokens[at] = random.choice(OTHERS)
    return tokens


def repeats_a_key(tokens: list[str]) -> bool:
    event = tokens[tokens.index("EVENT") :] if "EVENT" in tokens else []
    inside = [word for word, sign in pairwise(event) if sign == "=" and word in EVENT_KEYS]
    brackets = [text.partition("]")[0].split() for text in " ".join(tokens).split("[")[1:]]
    return len(set(inside)) < len(inside) or any(map(has_a_key_twice, brackets))


def is_beside_the_rules(tokens: list[str]) -> bool:
    """Whether the page's text rules, or the lexer: it reads `< =` with a blank inside as one operator."""
    split = re.search(r"[<>=] [<>=]", " ".join(tokens))
    return not tokens or split is not None or bool(OTHER_ANSWERS & set(tokens)) or repeats_a_key(tokens)


@pytest.mark.parametrize("number", [500, in_soak(100_000)])
def test_the_parser_refuses_what_the_grammar_does_not_allow_and_nothing_else(number: int) -> None:
    refused = 0
    for seed in range(number):
        tokens = near_miss(Random(seed))
        if not is_beside_the_rules(tokens):
            allowed = Recognizer(tokens).accepts("statements")
            refused += not allowed
            assert (errors(f"10 {' '.join(tokens)}") == []) is allowed, " ".join(tokens)
    assert refused > number / 3


def test_statements_of_basic_tasks_are_those_of_the_grammar() -> None:
    for seed in range(200):
        tokens = tokens_of(WAITING, Random(seed))
        text = f"10 {' '.join(tokens)}"
        assert Recognizer(tokens).accepts(WAITING), text
        assert errors(text, "TASK.BAS") == [], text
        assert errors(text, "TASK.BLK"), text


def test_near_misses_of_statements_of_basic_tasks_are_refused() -> None:
    refused = 0
    for seed in range(400):
        tokens = near_miss(Random(seed), (WAITING,))
        if tokens and not re.search(r"[<>=] [<>=]", " ".join(tokens)) and not FOREIGN_WORDS.keys() & {tokens[0]}:
            allowed = any(Recognizer(tokens).accepts(rule) for rule in (WAITING, "statement"))
            refused += not allowed
            assert (errors(f"10 {' '.join(tokens)}", "TASK.BAS") == []) is allowed, " ".join(tokens)
    assert refused > 130


@pytest.mark.parametrize(
    "text",
    [
        "10 IF A@ THEN\n20 A% = 1",
        "10 A% = 1\n20 END_IF",
        "10 FOR I% = 1 TO 3\n20 A% = 1",
        "10 FOR I% = 1 TO 3\n20 NEXT J%",
        "10 ELSE",
        "10 IF A@ THEN\n20 ELSE\n30 ELSE\n40 END_IF",
        "10 EVENT NAME = GO, TIMEOUT = 1, TIMEOUT = 2",
        "10 LOCAL G [LOW = 1.0, LOW = 2.0]",
        "10 A% = 1 REM TEXT",
        "A% = 1",
        "10 A% = 1\n10 B% = 1",
        "40000 A% = 1",
        "10 A% = 'TEXT",
        "10 A% = 1.2.3",
        "10 A% = 0FFFFFFFFFH",
        "10 A% = 123456789.5",
        "10 ABCDEFGHIJKLMNOPQ% = 1",
    ],
)
def test_what_lies_outside_of_the_rules_is_refused(text: str) -> None:
    assert errors(text)
