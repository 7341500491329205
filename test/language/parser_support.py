"""Short ways for the parser's tests: the statements of a text that has no problems."""

from automax_ros.core.diagnostics import SourceText
from automax_ros.language.parse.parser import parse
from automax_ros.language.tree.tree import Assignment, Expression, Module, Statement


def module_of(text: str) -> Module:
    """The tree of a text, which must have no problem."""
    module, problems = parse(SourceText("TASK.BLK", text))
    assert problems == []
    return module


def statements_of(text: str) -> tuple[Statement, ...]:
    """The statements of a text, which must have no problem."""
    return module_of(text).statements


def expression_of(text: str) -> Expression:
    """The tree of an expression, which must have no problem."""
    (statement,) = statements_of(f"10 RESULT = {text}")
    assert isinstance(statement, Assignment)
    return statement.value


def codes_of(text: str) -> list[str]:
    """The codes of a text's problems in the order in which they were found."""
    return [item.code for item in parse(SourceText("TASK.BLK", text))[1]]
