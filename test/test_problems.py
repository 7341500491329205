"""Every problem code can be raised: the package has a place that does, and a page's example or a test provokes it."""

import ast
import functools
import re
from pathlib import Path

import pytest

from automax_ros.core.problems import PROBLEMS

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "automax_ros"
TABLE = PACKAGE / "core" / "problems"
CODE = re.compile(r"AMX\d{4}")


def by_its_page(code: str) -> bool:
    """Whether the tests of the pages run the code's example: tasks, rack files, run time."""
    compiled, rack_file = code[3] in "024", "AMX6000" <= code < "AMX6700" or "AMX6701" <= code < "AMX6710"
    has_example = "## Example" in (PACKAGE / "core" / "pages" / f"{code}.md").read_text(encoding="utf-8")
    return has_example and (compiled or rack_file or code[3] == "7")


@functools.cache
def named_in_tests() -> set[str]:
    """The codes that a test function or its parameters name; what `automax explain` prints proves nothing."""
    named: set[str] = set()
    for path in (ROOT / "test").rglob("test_*.py"):
        if path.name == "test_cli_reference.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                named.update(CODE.findall(ast.unparse(node)))
    return named


def numbers_of(tree: ast.Module) -> set[str]:
    """The codes that a module of the package names, in full or, at run time, by their number."""
    values = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    codes = {f"AMX{value}" for value in values if isinstance(value, int) and 7000 <= value < 8000}
    return codes.union(*(CODE.findall(value) for value in values if isinstance(value, str)))


@pytest.mark.parametrize("code", [code for code in PROBLEMS if not by_its_page(code)])
def test_a_test_provokes_what_no_example_can(code):
    assert code in named_in_tests()


def test_every_code_has_a_place_that_raises_it():
    sources = [path for path in PACKAGE.rglob("*.py") if TABLE not in path.parents]
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in sources)
    assert set(PROBLEMS) - set().union(*map(numbers_of, trees)) == set()
