"""Words that cannot name a common variable, since no task could use it."""

from __future__ import annotations

from automax_ros.language.syntax.functions import FUNCTIONS, REFUSED_FUNCTIONS
from automax_ros.language.syntax.tokens import RESERVED_WORDS


def is_reserved(name: str) -> bool:
    """Whether a variable's name with its type character is a word or a function of the language."""
    return name in RESERVED_WORDS or name in FUNCTIONS or name in REFUSED_FUNCTIONS
