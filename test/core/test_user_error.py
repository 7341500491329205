"""What a person can mend: the text that is printed has place, code, message and hint, as far as there are any."""

import pytest

from automax_ros.core.user_error import UsageError, UserError
from automax_ros.recordings.mcap.errors import BagError


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (UserError("it is wrong"), "it is wrong"),
        (UserError("it is wrong", "mend it"), "it is wrong\n  hint: mend it"),
        (UserError("it is wrong", "mend it", code="AMX1"), "it is wrong\n  hint: mend it"),
        (UserError("it is wrong", code="AMX1", place="a:2"), "a:2: error[AMX1]: it is wrong"),
        (UsageError("no such file", "look again"), "no such file\n  hint: look again"),
        (BagError("AMX6810", "bag", "is\nempty", "repair it"), "bag: error[AMX6810]: is\ufffdempty\n  hint: repair it"),
        (BagError("AMX6810", "bag", "is empty"), "bag: error[AMX6810]: is empty"),
    ],
)
def test_text_that_is_printed(fault, text):
    assert str(fault) == text
    assert isinstance(fault, UserError)
