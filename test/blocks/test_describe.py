import re

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Access, Form, Platform, Special
from automax_ros.blocks.describe import WIDTH, description, summary, template, templates
from automax_ros.core.diagnostics import SourceText, render
from automax_ros.core.types import DataType
from automax_ros.language.checks.checker import check

each_block = pytest.mark.parametrize("block", list(CATALOGUE.values()), ids=lambda block: block.name)


def test_summary_has_one_line_a_block():
    lines = summary(CATALOGUE.values()).splitlines()
    assert [line.split()[0] for line in lines] == list(CATALOGUE)
    assert all(block.function in line for block, line in zip(CATALOGUE.values(), lines, strict=True))


@each_block
def test_description_tells_each_parameter(block):
    text = description(block)
    for item in block.parameters:
        (line,) = re.findall(rf"^  {item.name} .*$", text.split("Limits\n")[0], re.MULTILINE)
        assert item.symbol in line.split()
        assert item.text.split()[0] in line
    for rule in block.rules:
        assert rule.text in " ".join(text.split())
    for code in block.problems:
        assert code in text
    assert f"section {block.section}" in text
    assert text.endswith(template(block))
    assert max(map(len, text.splitlines())) <= WIDTH


def test_description_of_lag_word_for_word():
    assert description(CATALOGUE["LAG"]) == (
        """\
LAG: Lag (J-3676-5, section 43)

    1 / (1 + s/WLG)

Inputs
  INPUT          I    INTEGER  required       variable only        signal input
  WLG            WLG  REAL     required       variable or literal  lag frequency in rad/s
  WM             WM   REAL     optional       literal only         mapping frequency in rad/s, (2 pi
                                                                   / T) / 20 unless given
  INITIAL_VALUE  IV   INTEGER  default 0      variable or literal  the output while RESET is TRUE
  RESET          R    BOOLEAN  default FALSE  variable or literal  TRUE holds OUTPUT at
                                                                   INITIAL_VALUE

Outputs
  OUTPUT  O  INTEGER  required  the filtered signal

Limits
  WM   2**-17 / T  to  2 pi / (4.5 T)
  WLG  C x 2**-18  to  0.71 C
       with T the scan period in s, C = WM / tan(WM T / 2)

Notes
  - With Kx = WLG / C below 0.125 OUTPUT is limited to +-8191, below 0.25 to +-16383 (section 51).

Logs
  - AMX7004 coefficient out of its limits

Runs on: automax, pc3000, udc

Execution time, microseconds (section 53)
  7010 (57C435)                 26.52
  6010, 6011 (57C430A, 57C431)  118.00
  UDC                           41.00
  PC3000                        18.56

Template

nnnnn CALL LAG(INPUT=input%,                 &
               WLG=wlg,                      &
               WM=nnn.n,                     &
               INITIAL_VALUE=initial_value%, &
               RESET=reset@,                 &
               OUTPUT=output%)
"""
    )


@each_block
def test_template_names_every_keyword_once_in_typed_place_holders(block):
    text = template(block)
    found = re.findall(r"([A-Z0-9_]+)=([^,)]+)", text)
    assert [keyword for keyword, _ in found] == [item.name for item in block.parameters]
    for (_, value), item in zip(found, block.parameters, strict=True):
        if item.type is Special.EVENT:
            assert value == "event_name"
        elif isinstance(item.type, Special):
            assert value == item.name.lower() + item.type.element.value
        elif getattr(item, "form", None) is Form.LITERAL:
            assert re.fullmatch(r"nnn\.n|nnnnn|TRUE|FALSE|\d+", value)
        else:
            assert value == item.name.lower() + item.type.value
    assert text.startswith(f"nnnnn CALL {block.name}(")


@each_block
def test_every_line_of_a_template_but_the_last_is_continued(block):
    lines = template(block).splitlines()
    assert all(re.search(r", +&$", line) for line in lines[:-1])
    assert len({line.rindex("&") for line in lines[:-1]}) <= 1
    assert lines[-1].endswith(")")


def test_templates_of_all_blocks():
    text = templates(CATALOGUE.values())
    assert text.count(" CALL ") == len(CATALOGUE)
    assert text.count("\n\n") == len(CATALOGUE) - 1


@each_block
def test_a_template_with_its_place_holders_filled_in_is_a_task_without_errors(block):
    call = template(block).upper().replace("NNNNN CALL", "200 CALL").replace("NNN.N", "50.0").replace("NNNNN", "4")
    call = call.replace("EVENT_NAME", "RUNOUT")
    variables = sorted(set(re.findall(r"=([A-Z][A-Z0-9_]*[%@!]?)[,)]", call)) - {"TRUE", "FALSE", "RUNOUT"})
    task = "".join(f"{line} LOCAL {name}\n" for line, name in enumerate(variables, 10))
    for array in re.findall(r"TABLE\d%", call):
        task = task.replace(f"LOCAL {array}", f"LOCAL {array}(16)")
    if Platform.AUTOMAX not in block.runs_on:
        task = task.replace("LOCAL I_FDBK", "COMMON I_FDBK").replace("LOCAL OVERLOAD", "COMMON OVERLOAD")
    if block.structure is Access.USES:
        kind = DataType.BOOLEAN if block.name.endswith("BITS") else DataType.INTEGER
        shift = f"SHIFT_{block.name.partition('_')[2]}"
        channels = ", ".join(f"INPUT{n}={kind.zero}, OUTPUT{n}=OUT{n}{kind.value}".upper() for n in range(1, 9))
        task += "".join(f"{80 + n} LOCAL OUT{n}{kind.value}\n" for n in range(1, 9))
        call += f"250 CALL {shift}(STRUCTURE_NAME=STRUCTURE_NAME{kind.value}, MAX_COLUMNS=4, SHIFT=TRUE, {channels})\n"
    task = task.replace("LOCAL DIAG_DATA%", "LOCAL DIAG_DATA%(37,1)")
    if block.begins_scan:
        task += "90 COMMON ISCR%\n100 EVENT NAME=RUNOUT, INTERRUPT_STATUS=ISCR%, TIMEOUT=6\n"
    else:
        task += "100 CALL SCAN_LOOP(TICKS=4)\n"
    source = SourceText("TASK.BLK", f"{task}{call}300 END\n")
    target = Platform.AUTOMAX if Platform.AUTOMAX in block.runs_on else Platform.UDC
    result = check(source, name="TASK", catalogue=CATALOGUE, target=target)
    unprotected = target is Platform.UDC and block.name != "THERMAL_OVERLOAD"
    warnings = [item.code for item in result.diagnostics if unprotected and item.code == "AMX4097"]
    assert [render(item, source) for item in result.diagnostics][len(warnings) :] == []
    assert result.program is not None
