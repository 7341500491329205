"""Which commons a task can write, and where: every statement and output that writes."""

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from automax_ros.language.program import lines_that_write, places_that_write


def program(name: str, text: str):
    result = check(SourceText(name, text), name="TASK", catalogue=CATALOGUE)
    assert result.program is not None, result.diagnostics
    return result.program


def test_a_basic_task_writes_what_it_reads_from_channels_ports_and_data():
    text = """10 COMMON A%, B%, C$, D%, E%, T%(3)
20 LOCAL L%
30 OPEN CHANNEL FOR INPUT AS FILE #1, TYPE=(I,I), DEPTH=4
40 INPUT #1, A%, L%
50 READ B%
60 DATA 5
70 FOR D% = 1 TO 2
80 T%(D%) = E%
90 NEXT D%
100 IF E% = 1 THEN
110 B% = A%
120 END_IF
130 END
"""
    assert lines_that_write(program("TASK.BAS", text)) == {"A%": (40,), "B%": (50, 110), "D%": (70,), "T%": (80,)}


def test_a_control_block_task_writes_by_outputs_and_statements():
    text = """10 COMMON A%, B%, X@
20 CALL SCAN_LOOP(TICKS=4)
30 CALL LIMIT(INPUT=A%, LIMIT_PLUS=5, SATURATED_PLUS=X@, &
   OUTPUT=B%)
40 END
"""
    found = places_that_write(program("TASK.BLK", text))
    assert {name: [(line, span.line) for line, span in places] for name, places in found.items()} == {
        "X@": [(30, 3)],
        "B%": [(30, 4)],
    }
