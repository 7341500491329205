"""Refuses statements that the language does not have, or not in this kind of task, each with a specific error."""

from __future__ import annotations

from typing import NoReturn

from automax_ros.core.text import did_you_mean
from automax_ros.language.parse.cursor import Cursor
from automax_ros.language.text.lexer import TYPE_CHARACTERS
from automax_ros.language.text.tokens import BASIC_TASK_WORDS, RESERVED_WORDS, STATEMENT_WORDS, TokenKind
from automax_ros.language.tree.task_kind import TaskKind

FOREIGN_WORDS = {
    "DIM": "arrays are declared by LOCAL or COMMON: LOCAL TABLE%(16)",
    "DEF": "functions cannot be defined; use GOSUB",
    "WHILE": "use IF and GOTO, or FOR",
    "WEND": "use IF and GOTO, or FOR",
    "DO": "use IF and GOTO, or FOR",
    "LOOP": "use IF and GOTO, or FOR",
    "REPEAT": "use IF and GOTO, or FOR",
    "UNTIL": "use IF and GOTO, or FOR",
    "EXIT": "leave a loop by GOTO",
    "SELECT": "use ON value GOTO, or IF",
    "CASE": "use ON value GOTO, or IF",
    "SUB": "use GOSUB",
    "FUNCTION": "functions cannot be defined; use GOSUB",
    "RESUME": "errors do not stop a task; test the log with TST_ERRLOG@",
    "RANDOMIZE": "random numbers would make a run that cannot be repeated",
    "POKE": "use IOWRITE slot, register, value",
    "INCLUDE": "write the statements here; `automax convert` does it with an include file next to the task",
    "CHAIN": "tasks are put into RUN by the rack",
    "MEMDEF": "common variables are defined in the rack's YAML file",
    "NVMEMDEF": "common variables are defined in the rack's YAML file",
    "IODEF": "I/O points are defined in the rack's YAML file",
    "REMARK": "write REM or `!`",
    "GO": "write GOTO or GOSUB as one word",
    "CLEAR": "set variables to 0 by assignments",
    "INTEGER": "the type character tells the type: LOCAL A%",
    "REAL": "a name without type character is a REAL: LOCAL A",
    "BOOLEAN": "the type character tells the type: LOCAL A@",
    "STRING": "the type character tells the type: LOCAL A$",
}


def refuse_word(cursor: Cursor, kind: TaskKind) -> None:
    """Raise the specific error for a word that begins no statement of this kind of task, before it is read."""
    word = cursor.current.text
    if cursor.following.text == "=":
        if word in RESERVED_WORDS:
            cursor.fail("AMX0034", f"`{word}` is a word of the language and cannot name a variable")
        return
    if kind is not TaskKind.BASIC and word in BASIC_TASK_WORDS:
        message = f"{word} belongs to BASIC tasks: a control-block task must not be suspended"
        cursor.fail("AMX0031", message, BASIC_TASK_WORDS[word])
    if word in FOREIGN_WORDS:
        cursor.fail("AMX0032", f"{word} is not a statement of this language", FOREIGN_WORDS[word])


def refuse_statement(cursor: Cursor) -> NoReturn:
    """Raise the error for a token that begins no statement at all."""
    token = cursor.current
    hint: str | None = None
    if token.kind is TokenKind.WORD:
        if cursor.following.kind is TokenKind.ERROR and cursor.following.text in tuple(TYPE_CHARACTERS):
            cursor.advance()
        if token.text in ("THEN", "TO", "STEP", "AND", "OR", "XOR", "NOT"):
            hint = "did the line before it need an `&` at its end?"
            cursor.fail("AMX0030", f"{cursor.found()} cannot begin a statement", hint)
        hint = did_you_mean(token.text, STATEMENT_WORDS | BASIC_TASK_WORDS.keys())
        if hint is None and cursor.following.text == "(":
            hint = f"a block is called by CALL {token.text[:20]}("
        cursor.fail("AMX0030", f"{cursor.found()} is not a statement", hint)
    if token.kind is TokenKind.INTEGER:
        hint = "a line has one line number"
    elif token.text == "/":
        hint = "a remark begins with REM or `!`"
    cursor.fail("AMX0030", f"a statement cannot begin with {cursor.found()}", hint)
