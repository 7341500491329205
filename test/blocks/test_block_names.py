"""A block is known by its declaration: no other file of the package switches on the name of one."""

import ast
from pathlib import Path

import automax_ros
from automax_ros.blocks.catalogue import CATALOGUE, FAMILIES
from automax_ros.blocks.declare.declaration import Block

PACKAGE = Path(automax_ros.__file__).parent

OPERATORS = {"AND", "OR"}
"""Words of the language besides: they join conditions."""
MAY_NAME = {
    "blocks/examples.py": set(CATALOGUE),  # one example for each block, for the documentation
    "cli/tasks/compare_pulse.py": {"PULSE_MULT"},  # a command about this block and its Logix successor
    "logix/pulse_comparison.py": {"PULSE_MULT"},
    "compile/base/cost.py": {"SCAN_LOOP"},  # for the time of the latch, which has no CALL of its own
    "language/parse/unknown.py": {"SELECT", "FUNCTION"},  # statements of other BASICs that ours does not have
}
SPEAKS_THE_LANGUAGE = ("language/", "compile/")


def declaring_files():
    """The files of the families, from where the declarations come."""
    tree = ast.parse((PACKAGE / "blocks" / "catalogue.py").read_text())
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    names = [module.split(".")[1:] for module in modules if module.startswith("automax_ros.blocks.")]
    files = {f"{'/'.join(parts)}.py" for parts in names}
    return files | {"blocks/catalogue.py"}


def blocks_named(path):
    """Line and name wherever a source has a block's name as a text, or imports its declaration."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in CATALOGUE:
            yield node.lineno, node.value
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("automax_ros.blocks"):
            yield from ((node.lineno, alias.name) for alias in node.names if alias.name in CATALOGUE)


def test_no_file_names_a_block_that_it_does_not_declare():
    wrong = []
    declaring = declaring_files()
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        allowed = MAY_NAME.get(name, set()) | (OPERATORS if name.startswith(SPEAKS_THE_LANGUAGE) else set())
        if name not in declaring:
            wrong += [f"{name}:{line}: {found}" for line, found in blocks_named(path) if found not in allowed]
    assert not wrong


def test_the_exceptions_are_needed():
    for name, allowed in MAY_NAME.items():
        assert allowed & {block for _, block in blocks_named(PACKAGE / name)}, name


def test_declarations_are_the_only_blocks_there_are():
    declared = [block for family in FAMILIES for block in family.blocks]
    assert all(isinstance(block, Block) for block in declared)
    assert {block.name for block in declared} == set(CATALOGUE)


def test_two_blocks_begin_the_scan_and_have_no_step():
    assert [block.name for block in CATALOGUE.values() if block.begins_scan] == ["DC_DRIVE_CML", "SCAN_LOOP"]
    assert [block.name for block in CATALOGUE.values() if block.step is None] == ["DC_DRIVE_CML", "SCAN_LOOP"]
    assert [block.name for block in CATALOGUE.values() if block.line_scan] == ["DC_DRIVE_CML"]
