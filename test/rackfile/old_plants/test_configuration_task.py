"""Configuration tasks: what they define, and at least twenty faulty lines, each with its message and place."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import automax_ros.core
from automax_ros.core.diagnostics import SourceText
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import IoPoint
from automax_ros.rackfile.old_plants.configuration_task import DefinedTask, read_configuration
from automax_ros.rackfile.old_plants.import_ import rack_file_of

PAGES = Path(automax_ros.core.__file__).parent / "pages"
GOOD = """\
10 ! CONFIGURATION OF LINE 1
20 IODEF START_PB@[SLOT=5, REGISTER=0, BIT=3]
30 iodef start_word%[slot=5, &
      register=0]
40 MEMDEF LINE_REF%, TABLE%(10), NOTE$:50(2), TOTAL!
50 NVMEMDEF PRESET  ! KEPT
60 TASK SPEED[TYPE=BLK, SLOT=1, PRIORITY=5, CRITICAL=TRUE]
70 TASK DIAG[PRIORITY=11, SLOT=2, CRITICAL]
80 END
"""


def read(text: str):
    return read_configuration(SourceText("OLD.CNF", text))


def test_what_a_configuration_defines():
    found = read(GOOD)
    assert [item.code for item in found.diagnostics] == []
    assert [(item.declared.name, item.point, item.non_volatile, item.line) for item in found.commons] == [
        ("START_PB@", IoPoint(5, 0, 3), False, 2),
        ("START_WORD%", IoPoint(5, 0), False, 3),
        ("LINE_REF%", None, False, 5),
        ("TABLE%", None, False, 5),
        ("NOTE$", None, False, 5),
        ("TOTAL!", None, False, 5),
        ("PRESET", None, True, 6),
    ]
    assert found.commons[3].declared.dimensions == (11,)
    assert (found.commons[4].declared.length, found.commons[4].declared.dimensions) == (50, (3,))
    assert found.tasks == [
        DefinedTask("SPEED", "BLK", 1, 5, critical=True, line=7),
        DefinedTask("DIAG", "BLK", 2, 11, critical=True, line=8),
    ]


FAULTY = [
    ("10 IODF A@[SLOT=5, REGISTER=0, BIT=3]", "AMX6780", 4, "'IODF' is not a statement of a configuration task"),
    ("10 BITDEF A@[SLOT=5]", "AMX6780", 4, "'BITDEF' is not a statement"),
    ("10 A% = 5", "AMX6780", 4, "'A%' is not a statement"),
    ("10 5", "AMX6780", 4, "'5' is not a statement"),
    ("IODEF A%[SLOT=5, REGISTER=0]", "AMX0010", 1, "the line has no line number"),
    ("40000 MEMDEF A%", "AMX0011", 1, "line numbers go from 1 to 32767"),
    ("10 IODEF", "AMX6781", 9, "a variable's name is missing before ''"),
    ("10 IODEF [SLOT=5]", "AMX6781", 10, "a variable's name is missing before '['"),
    ("10 IODEF A%", "AMX6781", 12, "`[` is missing after the name"),
    ("10 IODEF A%(SLOT=5, REGISTER=0)", "AMX6404", 10, "the largest subscript of an array"),
    ("10 IODEF A%[SLOT=5, REGISTER=0", "AMX6781", 31, "`]` is missing after the last key"),
    ("10 IODEF A%[SLOT=5 REGISTER=0]", "AMX6781", 20, "`]` is missing after the last key"),
    ("10 IODEF A%[SLOT=5, REGISTER=0] B%", "AMX6781", 33, "'B%' is too much in this statement"),
    ("10 IODEF A%[SLOT=5]", "AMX6782", 10, "IODEF A% lacks REGISTER"),
    ("10 IODEF A@[SLOT=5, REGISTER=0]", "AMX6782", 10, "IODEF A@ lacks BIT"),
    ("10 IODEF A%[SLOTS=5, REGISTER=0]", "AMX6782", 13, "'SLOTS' is not a key of this statement"),
    ("10 IODEF A%[SLOT=5, SLOT=6, REGISTER=0]", "AMX6782", 21, "SLOT is given twice"),
    ("10 IODEF A%[SLOT=16, REGISTER=0]", "AMX6783", 18, "SLOT is 16; it must be 0 to 15"),
    ("10 IODEF A%[SLOT=5, REGISTER=70000]", "AMX6783", 30, "REGISTER is 70000; it must be 0 to 65535"),
    ("10 IODEF A@[SLOT=5, REGISTER=0, BIT=16]", "AMX6783", 37, "BIT is 16; it must be 0 to 15"),
    ("10 IODEF A%[SLOT=5.0, REGISTER=0]", "AMX6783", 18, "SLOT must be a whole number"),
    ("10 IODEF A%[SLOT, REGISTER=0]", "AMX6783", 13, "SLOT must be a whole number"),
    ("10 IODEF A[SLOT=5, REGISTER=0]", "AMX6785", 10, "A cannot be an I/O point: it is REAL"),
    ("10 IODEF A$[SLOT=5, REGISTER=0]", "AMX6785", 10, "A$ cannot be an I/O point: it is STRING"),
    ("10 IODEF A%(3)[SLOT=5, REGISTER=0]", "AMX6785", 10, "A% cannot be an I/O point: it is an array"),
    ("10 IODEF A%[SLOT=5, REGISTER=0, BIT=3]", "AMX6785", 33, "A% has a bit but is not BOOLEAN"),
    ("10 MEMDEF A%, A%", "AMX6784", 15, "A% is already defined"),
    ("10 MEMDEF A%,", "AMX6781", 14, "a variable's name is missing before ''"),
    ("10 MEMDEF A%(", "AMX6781", 14, "`)` is missing after A%"),
    ("10 MEMDEF A%(1,2,3,4,5)", "AMX6404", 11, "an array has at most 4 subscripts"),
    ("10 MEMDEF A$:300", "AMX6405", 11, "the length of a string is 1 to 255"),
    ("10 MEMDEF A%:5", "AMX6405", 11, "only a string has a length"),
    ("10 MEMDEF A_NAME_OF_17_CHRS%", "AMX6400", 11, "at most 16 characters"),
    ('10 MEMDEF "A', "AMX0020", 11, "the string is not closed"),
    ("10 TASK SPEED", "AMX6781", 14, "`[` is missing after the name"),
    ("10 TASK SPEED[TYPE=BLK, PRIORITY=5]", "AMX6782", 9, "TASK SPEED lacks SLOT"),
    ("10 TASK SPEED[SLOT=1, PRIORITY=3]", "AMX6783", 32, "PRIORITY is 3; it must be 4 to 11"),
    ("10 TASK SPEED[SLOT=5, PRIORITY=5]", "AMX6783", 20, "SLOT is 5; it must be 0 to 4"),
    ("10 TASK SPEED[TYPE=XYZ, SLOT=1, PRIORITY=5]", "AMX6783", 20, "TYPE must be BAS, BLK, PC"),
    ("10 TASK SPEED[CRITICAL=5, SLOT=1, PRIORITY=5]", "AMX6783", 24, "CRITICAL must be TRUE, FALSE"),
    ("10 TASK SPEED_CONTROL[SLOT=1, PRIORITY=5]", "AMX6300", 9, "a task's name has at most 8 characters"),
    ("10 NETDEF A%[DROP=1, DROP=2]", "AMX6782", 22, "DROP is given twice"),
    ("10 NETDEF A%[DROP=1, REGISTER=32]", "AMX6786", 11, "A% is defined by NETDEF"),
    ("10 RIODEF A@[MASTER_SLOT=7, DROP=1, SLOT=3, REGISTER=0, BIT=5]", "AMX6786", 11, "A@ is defined by RIODEF"),
]


@pytest.mark.parametrize(("line", "code", "column", "message"), FAULTY, ids=[item[0] for item in FAULTY])
def test_a_faulty_line_is_told_at_its_place(line, code, column, message):
    """The lines before and after it are read all the same."""
    found = read(f"5 MEMDEF BEFORE%\n{line}\n50000\n32700 MEMDEF AFTER%\n".replace("50000\n", ""))
    (fault,) = found.diagnostics
    assert (fault.code, fault.span.line, fault.span.column) == (code, 2, column)
    assert message in fault.message
    assert {"BEFORE%", "AFTER%"} <= {item.declared.name for item in found.commons}


@pytest.mark.parametrize("code", ["AMX6780", "AMX6781", "AMX6782", "AMX6783", "AMX6784", "AMX6785", "AMX6786"])
def test_the_page_of_each_problem_shows_it(code):
    text = (PAGES / f"{code}.md").read_text(encoding="utf-8")
    example, cure = (part.partition("```")[0] for part in text.split("```cnf\n")[1:])
    assert [item.code for item in read(example).diagnostics] == [code]
    assert read(cure).diagnostics == []


@given(st.text(alphabet="10 IODEFMTASK[]=(),:%@$!\n&\"'.REGSLOB5", max_size=120) | st.text(max_size=60))
@settings(max_examples=300, deadline=None, derandomize=True, database=None)
def test_whatever_the_text_it_is_read(text):
    read(text)


def test_of_very_many_faulty_lines_the_first_are_told_and_all_good_ones_read():
    text = "".join(f"{number} FOODEF A%\n" for number in range(1, 1101)) + "2000 MEMDEF AFTER%\n"
    found = read(text)
    assert len(found.diagnostics) == 1001
    assert (found.diagnostics[-1].code, found.diagnostics[-1].span.line) == ("AMX0002", 1001)
    assert [item.declared.name for item in found.commons] == ["AFTER%"]


NAMES = st.from_regex(r"X[A-Z0-9_]{0,9}", fullmatch=True)
DEFINITIONS = st.lists(
    st.one_of(
        st.builds("MEMDEF {}%({})".format, NAMES, st.integers(0, 50)),
        st.builds("NVMEMDEF {}".format, NAMES),
        st.builds("MEMDEF {}$:{}".format, NAMES, st.integers(1, 255)),
        st.builds(
            "IODEF {}@[SLOT={}, REGISTER={}, BIT={}]".format,
            NAMES, st.integers(0, 15), st.integers(0, 65535), st.integers(0, 15),
        ),
        st.builds("IODEF {}![SLOT={}, REGISTER={}]".format, NAMES, st.integers(0, 15), st.integers(0, 65535)),
        st.builds("RIODEF {}%[DROP={}]".format, NAMES, st.integers(1, 7)),
        st.builds("TASK {}[SLOT={}, PRIORITY={}]".format, NAMES.map(lambda x: x[:8]), st.integers(0, 4),
                  st.integers(4, 11)),
    ),
    max_size=12,
)  # fmt: skip


@given(DEFINITIONS)
@settings(max_examples=150, deadline=None, derandomize=True, database=None)
def test_the_rack_file_of_any_definitions_is_a_rack(tmp_path_factory, definitions):
    folder = tmp_path_factory.getbasetemp()
    text = "".join(f"{number} {item}\n" for number, item in enumerate(definitions, 1))
    made = rack_file_of(read(text), "OLD", folder, {}, (".BLK",))
    loaded = load_stored(SourceText("rack.yaml", made.text), folder / "rack.yaml")
    assert loaded.config is not None, made.text
    assert {item.code for item in loaded.diagnostics} <= {"AMX6403", "AMX6412"}
    assert {item.name for item in loaded.config.declared} == {item.declared.name for item in read(text).commons}
