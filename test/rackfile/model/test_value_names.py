"""Names and values from a command line; test/cli/run/test_run.py has the messages."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rack.helpers import HEAD, good

from automax_ros.core.kinds import Direction
from automax_ros.core.names import NameFault
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UserError
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.model.value_names import DEFAULT_WATCHED, setting, watched

COMMON = """\
common:
  REF%: {}
  GRID%(1,2): {ros: out}
  NOTE$:8: {}
  SHUT%: {ros: closed}
  A%: {}
  B@: {}
  C!: {}
  D: {}
  E%: {}
"""


@pytest.fixture
def config(tmp_path) -> RackConfig:
    return good(tmp_path, HEAD + COMMON)


def test_default_is_the_first_published_numbers_and_booleans(config):
    names = [item.name for item in watched(config, None)]
    assert names == ["REF%", "A%", "B@", "C!", "D"]
    assert len(names) == DEFAULT_WATCHED


def test_what_control_block_tasks_write_comes_before_inputs(tmp_path):
    """Finding 14: the first published commons of a rack are its panel's push-buttons."""
    head = HEAD.replace("LINE: {priority: 5}", "LINE: {priority: 5}, DIAG: {priority: 11, file: DIAG.BAS}")
    (tmp_path / "DIAG.BAS").write_text("10 COMMON B@\n20 B@=TRUE\n30 END\n")
    config = good(tmp_path, head + COMMON)
    (tmp_path / "LINE.BLK").write_text(
        "10 COMMON REF%, A%, D\n20 CALL SCAN_LOOP(TICKS=2)\n30 CALL LIMIT(INPUT=REF%, OUTPUT=A%)\n40 D=1.0\n50 END\n"
    )
    programs = Rack(config).operations.installation.programs.values()
    assert [item.name for item in watched(config, None, programs)] == ["A%", "D", "REF%", "B@", "C!"]


def test_what_the_rack_file_watches_comes_first_of_all(tmp_path):
    config = good(tmp_path, HEAD + COMMON + "watch: [e%, 'GRID%(1,2)', NOTE$]\n")
    assert [item.label for item in watched(config, None)] == ["E%", "GRID%(1,2)", "NOTE$"]
    assert [item.label for item in watched(config, ["A%"])] == ["A%"]
    assert watched(good(tmp_path, HEAD + COMMON + "watch: []\n"), None) == ()


def test_names_of_the_command_line_keep_their_order(config):
    found = watched(config, ["d", "SHUT%", "note$", "grid%(1, 2)"])
    assert [item.index for item in found] == [0, 0, 0, 5]
    assert [item.label for item in found] == [
        "D",
        "SHUT%",
        "NOTE$",
        "GRID%(1,2)",
    ]
    assert watched(config, []) == []


@given(first=st.integers(0, 1), second=st.integers(0, 2))
def test_last_subscript_runs_fastest(first, second):
    variable = CommonVariable("GRID%", DataType.INTEGER, (2, 3), direction=Direction.OUT)
    (found,) = watched(_rack_of(variable), [f"GRID%({first},{second})"])
    assert found.index == 3 * first + second


def _rack_of(variable: CommonVariable) -> RackConfig:
    from pathlib import Path

    return RackConfig("LINE1", "line1", Path("rack.yaml"), "", False, (), (variable,))


@pytest.mark.parametrize(
    "name", ["GRID%", "GRID%(2,0)", "GRID%(0,3)", "GRID%(0)", "REF%(0)", "NONE%", "", "GRID%(-1,0)"]
)
def test_what_does_not_exist_cannot_be_watched(config, name):
    with pytest.raises(NameFault):
        watched(config, [name])


def test_setting_names_the_variable_as_the_rack_does(config):
    assert setting(config, " ref% = 12 ") == ("REF%", 12)
    assert setting(config, "NOTE$= a=b ") == ("NOTE$", "a=b")


def test_an_element_can_be_set(config):
    assert setting(config, "grid%[1, 2] = 3") == ("GRID%(1,2)", 3)
    with pytest.raises(UserError, match="GRID% is an array"):
        setting(config, "GRID%=3")


@pytest.mark.parametrize("name", ["FORCINGSTATUS@", "BATTERYSTATUS0@", "AUTORUNSTATUS@"])
def test_what_the_rack_itself_writes_cannot_be_set(tmp_path, name):
    """2.4.6."""
    config = good(tmp_path, f"{HEAD}common:\n  {name}:\n")
    with pytest.raises(NameFault, match="the rack itself writes it"):
        setting(config, f"{name.lower()}=1")


def test_lone_surrogates_are_no_text(config):
    with pytest.raises(UserError, match=r"not a value for NOTE\$"):
        setting(config, "NOTE$=\udcff")
