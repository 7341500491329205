"""Tests whose longer runs are those of `make soak`."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis.strategies import SearchStrategy

Drawn = tuple[SearchStrategy[Any], ...]


def in_soak(*values: Any, timeout_s: int = 600) -> Any:
    """Return parameters of a test with which `make soak` alone runs it."""
    return pytest.param(*values, marks=[pytest.mark.soak, pytest.mark.timeout(timeout_s)])


def holds_for(examples: int, *drawn: SearchStrategy[Any], soak: tuple[int, Drawn]) -> Callable[..., Any]:
    """Make a test of a property that holds for what is drawn, and in `make soak` for more examples of more."""

    def test_of(holds: Callable[..., None]) -> Callable[..., None]:
        @pytest.mark.parametrize(
            ("examples", "drawn"), [(examples, drawn), in_soak(*soak, timeout_s=1200)], ids=["few", "many"]
        )
        def test(examples: int, drawn: Drawn) -> None:
            chosen = settings(deadline=None, derandomize=True, max_examples=examples, database=None)
            chosen(given(*drawn)(holds))()

        test.__name__, test.__doc__ = holds.__name__, holds.__doc__
        return test

    return test_of
