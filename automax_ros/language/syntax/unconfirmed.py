"""Forms of the language that no source confirms: their spelling or meaning is ours (decision).

``automax check --json`` marks what it says about them, so that a user of a real rack knows where to be careful.
"""

from __future__ import annotations

from automax_ros.language.syntax.functions import FUNCTIONS

UNCONFIRMED_STATEMENTS: dict[str, str] = {
    "CALL": "CALL after `\\` or THEN: section 3.1 wants a line number",
    "IOWRITE": "IOWRITE slot, register, value: the name and the order of the operands",
    "EMPTY": "EMPTY= and FULL=: where the number of the channel or port stands",
    "GET": "GET #n, variable and PUT #n, string: the operands",
    "SET": "SET in a control-block task: no source lists it there",
    "TUNABLE": "LOCAL NAME [CURRENT=..., HIGH=..., LOW=..., STEP=...]: the bracket and its keys",
}
"""Statements and parts of statements, with what is not confirmed of them."""

UNCONFIRMED_FUNCTIONS: dict[str, str] = {
    name: f"{name}: the name and its arguments" for name, function in FUNCTIONS.items() if function.unconfirmed
}
"""Functions, with what is not confirmed of them."""
