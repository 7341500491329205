"""Names of common variables, their lengths and subscripts (2.4.1 to 2.4.4)."""

import pytest
from rack.helpers import HEAD, codes

from automax_ros.core.types import DataType
from automax_ros.language.text.tokens import RESERVED_WORDS
from automax_ros.rackfile.reading.names import DeclarationFault, VariableName, variable_name


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("A", VariableName("A", DataType.REAL, 0, ())),
        ("_A1%", VariableName("_A1%", DataType.INTEGER, 0, ())),
        ("ABCDEFGHIJKLMNOP!", VariableName("ABCDEFGHIJKLMNOP!", DataType.DOUBLE, 0, ())),
        ("RUN@[1,2]", VariableName("RUN@", DataType.BOOLEAN, 0, (2, 3))),
        ("B%(6, 3)", VariableName("B%", DataType.INTEGER, 0, (7, 4))),
        ("A$:10(20)", VariableName("A$", DataType.STRING, 10, (21,))),
        ("A$ (0)", VariableName("A$", DataType.STRING, 31, (1,))),
        ("G(65534)", VariableName("G", DataType.REAL, 0, (65535,))),
    ],
)
def test_declarations(text, expected):
    assert variable_name(text) == expected


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "AMX6400"),
        ("1A%", "AMX6400"),
        ("A-B", "AMX6400"),
        ("A B%", "AMX6400"),
        ("A%%", "AMX6400"),
        ("A%(1](2)", "AMX6400"),
        ("A%(1]", "AMX6400"),
        ("A%(1)%", "AMX6400"),
        ("ABCDEFGHIJKLMNOPQ%", "AMX6400"),
        ("A$:0", "AMX6405"),
        ("A$:256", "AMX6405"),
        ("A$:", "AMX6405"),
        ("A%:5", "AMX6405"),
        ("A%()", "AMX6404"),
        ("A%(-1)", "AMX6404"),
        ("A%(65535)", "AMX6404"),
        ("A%(N%)", "AMX6404"),
        ("A%(N)", "AMX6404"),
        ("A%(1,2,3,4,5)", "AMX6404"),
        ("A%(1000,1000)", "AMX6404"),
        ("A%(\u0663)", "AMX6404"),
    ],
)
def test_declarations_that_break_a_rule(text, code):
    with pytest.raises(DeclarationFault) as caught:
        variable_name(text)
    assert caught.value.code == code


@pytest.mark.parametrize("word", [*sorted(RESERVED_WORDS), "ABS", "LEN%", "VARPTR!"])
def test_words_of_the_language_are_no_variables(tmp_path, word):
    assert codes(tmp_path, f"{HEAD}common:\n  '{word}':\n") == ["AMX6401"]


@pytest.mark.parametrize("word", ["IF%", "TO@", "ABS%", "LEN"])
def test_same_words_with_another_type_are(tmp_path, word):
    assert codes(tmp_path, f"{HEAD}common:\n  {word}:\n") == []
