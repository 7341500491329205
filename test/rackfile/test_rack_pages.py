"""Every page of a rack file's problem: its example has that problem and no other, its cure has none of it."""

import re
from pathlib import Path

import pytest
from rack.helpers import write

import automax_ros.core
from automax_ros.core.problems import PROBLEMS
from automax_ros.rackfile.checks.tasks import check_tasks, forgotten
from automax_ros.rackfile.loader import LoadResult, load
from automax_ros.rackfile.reading.files import MAX_BYTES

PAGES = Path(automax_ros.core.__file__).parent / "pages"
TOO_LONG = ("AMX6481",)
"""Problems whose examples would not fit on a page."""
FORGOTTEN = ("AMX6224", "AMX6496", "AMX6497", "AMX6498", "AMX6499")
"""What `automax check` says of a rack as a whole; short examples of other problems leave out much."""
CODES = [
    code
    for code in PROBLEMS
    if ("AMX6000" <= code < "AMX6700" or "AMX6701" <= code < "AMX6710" or code == "AMX6788") and code not in TOO_LONG
]


def section(code: str, heading: str) -> str:
    text = (PAGES / f"{code}.md").read_text(encoding="utf-8")
    match = re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", text, re.M | re.S)
    assert match, f"{code} has no {heading}"
    return match[1]


def part(code: str, heading: str) -> str:
    match = re.search(r"^```yaml\n(.*?)^```$", section(code, heading), re.M | re.S)
    assert match, f"{code}: {heading} has no rack file"
    return match[1]


def write_tasks(code: str, heading: str, folder: Path) -> None:
    """Write the tasks of the page over those that every rack of these tests has."""
    tasks = re.findall(r"^```basic\n(.*?)^```$", section(code, heading), re.M | re.S)
    for name, text in zip(("LINE", "DRAW", "WIND"), tasks, strict=False):
        (folder / f"{name}.BLK").write_text(text)


def example_file(code: str, folder: Path) -> Path:
    """Write the example; some of them are about what a page cannot show."""
    text = part(code, "Example")
    if code == "AMX6412":
        text = text.replace("# and so on\n", "\n  ".join(f"V{number}%:" for number in range(2, 201)) + "\n")
    path = write(folder, text)
    write_tasks(code, "Example", folder)
    if code == "AMX6000":
        return folder / "other.yaml"
    if code == "AMX6001":
        path.write_text(text + "#" * MAX_BYTES)
    if code == "AMX6002":
        path.write_bytes(text.encode("latin-1"))
    return path


def read(path: Path) -> LoadResult:
    (path.parent / "BIG.BLK").write_bytes(b"!" * (MAX_BYTES + 1))
    return load(path)


def codes_of(result: LoadResult, *, whole: bool = False) -> set[str]:
    """All that is found in a rack file and, if it is right, in its tasks; ``whole``: what looks forgotten in it."""
    tasks = check_tasks(result.config) if result.config is not None else []
    if result.config is not None and whole:
        return {item.code for item in forgotten(result.config, tasks)}
    return {item.code for found in (result.diagnostics, *(task.result.diagnostics for task in tasks)) for item in found}


@pytest.mark.parametrize("code", CODES)
def test_example_has_exactly_the_problem_of_its_page(code, tmp_path):
    assert codes_of(read(example_file(code, tmp_path)), whole=code in FORGOTTEN) == {code}


@pytest.mark.parametrize("code", CODES)
def test_cure_is_a_rack_without_problems(code, tmp_path):
    path = write(tmp_path, part(code, "Cure"))
    write_tasks(code, "Cure", tmp_path)
    result = read(path)
    assert codes_of(result) == set()
    assert code not in FORGOTTEN or codes_of(result, whole=True) == set()
    assert result.config is not None
