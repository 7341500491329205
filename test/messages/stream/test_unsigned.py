import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from librt.strings import BytesWriter, write_i16_le, write_i32_le, write_i64_le

from automax_ros.messages.stream.task_messages import as_i16, as_i32, as_i64

FORMS = [(as_i16, write_i16_le, "<H", 16), (as_i32, write_i32_le, "<I", 32), (as_i64, write_i64_le, "<Q", 64)]


@pytest.mark.parametrize(("signed", "write", "code", "bits"), FORMS)
@given(data=st.data())
def test_a_number_is_written_with_its_bits(signed, write, code, bits, data):
    edges = st.sampled_from([0, 1, (1 << bits - 1) - 1, 1 << bits - 1, (1 << bits) - 1])
    number = data.draw(edges | st.integers(0, (1 << bits) - 1))
    written = BytesWriter()
    write(written, signed(number))
    assert written.getvalue() == struct.pack(code, number)


@pytest.mark.parametrize(("signed", "write", "code", "bits"), FORMS)
def test_a_number_out_of_range_is_refused(signed, write, code, bits):
    for number in (-1, 1 << bits):
        with pytest.raises(struct.error):
            struct.pack(code, number)
        with pytest.raises(OverflowError, match=f"{number} does not fit"):
            signed(number)
