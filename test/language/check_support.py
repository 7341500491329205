"""Short ways to check a task in tests."""

from __future__ import annotations

from collections.abc import Mapping

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Diagnostic, Severity, SourceText
from automax_ros.language.checks.checker import CheckResult, check
from automax_ros.language.program import CommonSpec, Program


def check_text(
    text: str,
    *,
    target: Platform = Platform.AUTOMAX,
    tick_ns: int = 5_500_000,
    commons: Mapping[str, CommonSpec] | None = None,
) -> CheckResult:
    source = SourceText("task.blk", text)
    return check(source, name="TASK", catalogue=CATALOGUE, target=target, tick_ns=tick_ns, commons=commons)


def task(*lines: str, declare: str = "LOCAL A%, B%, C%, D!, R, X@, Y@, S$, T%(10)") -> str:
    """A task of numbered lines: declarations in line 10, SCAN_LOOP in 20, then 30, 40 ... and END."""
    numbered = [f"{30 + 10 * index} {line}" for index, line in enumerate(lines)]
    head = [f"10 {declare}", "20 CALL SCAN_LOOP(TICKS=4)"]
    return "\n".join([*head, *numbered, f"{30 + 10 * len(lines)} END"]) + "\n"


def problems(text: str, **options: object) -> list[Diagnostic]:
    return check_text(text, **options).diagnostics  # type: ignore[arg-type]


def codes(text: str, **options: object) -> list[str]:
    """The codes of the problems, in the order of the text."""
    return [item.code for item in problems(text, **options)]


def errors_of(text: str, **options: object) -> list[str]:
    """The codes of the errors; a UDC task without THERMAL_OVERLOAD, say, has a warning besides."""
    return [item.code for item in problems(text, **options) if item.severity is Severity.ERROR]


def one(text: str, **options: object) -> Diagnostic:
    found = problems(text, **options)
    assert len(found) == 1, found
    return found[0]


def program(text: str, **options: object) -> Program:
    result = check_text(text, **options)  # type: ignore[arg-type]
    assert result.program is not None, result.diagnostics
    return result.program
