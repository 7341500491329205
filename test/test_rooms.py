"""The rooms of the package: what may import what, as the table in CONTRIBUTING.md says."""

import ast
import re
from collections import Counter
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "automax_ros"
MOST_FILES = 15


def folder_imports() -> dict[str, set[str]]:
    """Each folder of the package with those that its files import, wherever in the file."""
    modules = {path.relative_to(ROOT).with_suffix("").parts: path for path in PACKAGE.rglob("*.py")}
    found: dict[str, set[str]] = {}
    for path in modules.values():
        folder = path.relative_to(ROOT).parent
        targets = found.setdefault(str(folder), set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert not node.level, f"{path}: imports are absolute"
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            else:
                continue
            for parts in (tuple(name.split(".")) for name in names):
                module = parts if parts in modules else parts[:-1]
                if module in modules and len(module) > 2:
                    targets.add(str(Path(*module[:-1])))
        targets.discard(str(folder))
    return found


def test_a_room_imports_only_from_rooms_above_it_and_no_folder_in_a_circle():
    table = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rank = {room: place for place, room in enumerate(re.findall(r"^\| `(\w+)/` \|", table, re.MULTILINE))}
    folders = folder_imports()
    assert {Path(folder).parts[1] for folder in folders if "/" in folder} == set(rank)
    wrong = [
        f"{folder} imports {target}"
        for folder, targets in folders.items()
        for target in targets
        # The package's own file imports, when they are asked for, the names that it offers.
        if "/" in folder and rank[Path(folder).parts[1]] < rank[Path(target).parts[1]]
    ]
    assert not wrong
    try:
        list(
            TopologicalSorter({folder: targets for folder, targets in folders.items() if "/" in folder}).static_order()
        )
    except CycleError as error:
        pytest.fail(f"a circle of folders: {' -> '.join(reversed(error.args[1]))}")
    files = Counter(str(path.parent) for path in PACKAGE.rglob("*.py") if path.name != "__init__.py")
    assert {folder: count for folder, count in files.items() if count > MOST_FILES} == {}
