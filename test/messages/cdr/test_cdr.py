"""The bytes of messages: by hand, against a simple model, and against rclpy."""

from __future__ import annotations

import contextlib
import struct
from array import array
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings.recordings import messages, table_like
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from automax_ros.messages.cdr.cdr import HEADER, CdrError, _appender, decode, decoder, encode, encoder
from automax_ros.messages.types.definitions import TIME, message_types, schema_text
from automax_ros.messages.types.messages import (
    CLASSES,
    NAMES,
    NO_VALUES,
    Bool,
    Clock,
    CommonWrite,
    Float32,
    Int16,
    Int16MultiArray,
    MultiArrayDimension,
    MultiArrayLayout,
    Scan,
    ScanError,
    String,
    Values,
)

ALL = sorted(CLASSES)
REPEATABLE = settings(deadline=None, derandomize=True, max_examples=60)


def hexed(text: str) -> bytes:
    return bytes.fromhex(text)


@pytest.mark.parametrize(
    ("message", "data"),
    [
        (Bool(True), "00010000 01"),
        (Int16(-2), "00010000 feff"),
        (Float32(1.5), "00010000 0000c03f"),
        (String(""), "00010000 01000000 00"),
        (String("é"), "00010000 03000000 c3a900"),
        (Clock(1_000_000_002), "00010000 01000000 02000000"),
        (Clock(-1), "00010000 ffffffff ffc99a3b"),
        (
            Int16MultiArray(MultiArrayLayout((MultiArrayDimension("x", 3, 3),)), (1, 2, 3)),
            "00010000 01000000 02000000 7800 0000 03000000 03000000 00000000 03000000 0100 0200 0300",
        ),
        # an empty list of doubles is its length alone: the texts follow at a multiple of 4, not of 8
        (Values((), (), (), ("a",)), "00010000 00000000 00000000 00000000 01000000 02000000 6100"),
        (
            Values((7,), (2,), (0.5,), ()),
            "00010000 01000000 0700 0000 01000000 02000000 01000000 00000000 000000000000e03f 00000000",
        ),
    ],
)
def test_bytes_by_hand(message: Any, data: str) -> None:
    assert encode(message) == hexed(data)
    assert decode(NAMES[type(message)], hexed(data)) == message


class Model:
    """CDR word for word, one number after the other, and which bytes are padding."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.padding: set[int] = set()

    def number(self, code: str, value: Any) -> None:
        size = struct.calcsize("<" + code)
        while len(self.data) % size:
            self.padding.add(len(self.data) + 4)
            self.data.append(0)
        self.data += struct.pack("<" + code, value)

    def value(self, kind: str, value: Any) -> None:
        codes = {"bool": "?", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "uint64": "Q"}
        codes |= {"int64": "q", "float32": "f", "float64": "d"}
        if kind == TIME:
            self.number("i", value // 10**9)
            self.number("I", value % 10**9)
        elif kind == "string":
            self.number("I", len(value.encode()) + 1)
            self.data += value.encode() + b"\0"
        elif kind in codes:
            self.number(codes[kind], value)
        else:
            self.message(kind, value)

    def message(self, kind: str, message: Any) -> None:
        for field in message_types()[kind].definition.fields:
            value = getattr(message, field.name)
            if field.array:
                self.number("I", len(value))
                for item in value:
                    self.value(field.kind, item)
            else:
                self.value(field.kind, value)


def modelled(message: Any) -> tuple[bytes, set[int]]:
    model = Model()
    model.message(NAMES[type(message)], message)
    return b"\0\1\0\0" + bytes(model.data), model.padding


@pytest.mark.parametrize("name", ALL)
def test_bytes_are_those_of_the_model_and_read_back(name: str) -> None:
    @REPEATABLE
    @given(messages(name))
    def check(message: Any) -> None:
        data = encode(message)
        assert data == modelled(message)[0]
        assert decode(name, data) == message

    check()


def ros_message(message: Any) -> Any:
    """The same message as an instance of rclpy's class."""
    import importlib

    name = NAMES[type(message)]
    package, _, kind = name.split("/")
    ros = getattr(importlib.import_module(f"{package}.msg"), kind)()
    for field in message_types()[name].definition.fields:
        value = getattr(message, field.name)
        setattr(ros, field.name, [ros_value(item) for item in value] if field.array else ros_value(value, field.kind))
    return ros


def ros_value(value: Any, kind: str = "") -> Any:
    if kind == TIME:
        from builtin_interfaces.msg import Time

        return Time(sec=value // 10**9, nanosec=value % 10**9)
    return ros_message(value) if type(value) in NAMES else value


@pytest.mark.parametrize("name", ALL)
def test_bytes_are_those_of_rclpy(name: str) -> None:
    serialization = pytest.importorskip("rclpy.serialization")
    pytest.importorskip(name.split("/", maxsplit=1)[0] + ".msg")

    @REPEATABLE
    @given(messages(name))
    def check(message: Any) -> None:
        ours, padding = encode(message), modelled(message)[1]
        ros = ros_message(message)
        theirs = serialization.serialize_message(ros)
        # ROS leaves padding as it finds it, and reserves some bytes too many after empty lists
        masked = bytes(0 if index in padding else byte for index, byte in enumerate(theirs))
        assert masked[: len(ours)] == ours
        assert decode(name, theirs) == message
        assert serialization.deserialize_message(ours, type(ros)) == ros

    check()


@pytest.mark.parametrize("name", ALL)
def test_rosbags_understands_the_bytes(name: str) -> None:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_text(name), name))

    @settings(REPEATABLE, max_examples=15)
    @given(messages(name))
    def check(message: Any) -> None:
        assert same(store.deserialize_cdr(encode(message), name), message, name)

    check()


def same(theirs: Any, ours: Any, name: str) -> bool:
    """Whether a message of rosbags (lists as numpy arrays) equals ours."""
    for field in message_types()[name].definition.fields:
        their_value, our_value = getattr(theirs, field.name), getattr(ours, field.name)
        if not field.array:
            their_value, our_value = [their_value], [our_value]
        if field.kind == TIME:
            their_value = [item.sec * 10**9 + item.nanosec for item in their_value]
        if field.kind in CLASSES:
            if not all(same(*pair, field.kind) for pair in zip(their_value, our_value, strict=True)):
                return False
        elif list(their_value) != list(our_value):
            return False
    return True


def test_sequences_may_be_lists_tuples_and_arrays() -> None:
    data = encode(Values((1, 2), (0, 0), (1.0, 2.0), ("a",)))
    assert encode(Values([1, 2], [0, 0], [1.0, 2.0], ["a"])) == data
    assert encode(Values(array("H", [1, 2]), array("I", [0, 0]), array("d", [1.0, 2.0]), ["a"])) == data


def test_many_shapes_of_lists_do_not_mix() -> None:
    for count in range(5000):
        message = Int16MultiArray(data=(0,) * (count % 4500))
        assert len(encode(message)) == 16 + 2 * (count % 4500)


WRITE = CommonWrite(5, 1, 2, 1, 1, 9, Values((1,), (0,), (2.0,)))


@pytest.mark.parametrize(
    "message",
    [
        Int16(40000),
        Int16("x"),  # type: ignore[arg-type]
        Float32(1e300),
        String(5),  # type: ignore[arg-type]
        String("\ud800"),
        Clock(2**31 * 10**9),
        WRITE._replace(values=Values((70000,), (0,), (1.0,))),
        WRITE._replace(values=Values((-1,), (0,), (1.0,))),
        WRITE._replace(sequence=-1),
        WRITE._replace(stamp=0.5),  # type: ignore[arg-type]
        WRITE._replace(values=None),  # type: ignore[arg-type]
    ],
)
def test_values_that_do_not_fit_are_refused(message: Any) -> None:
    with pytest.raises(CdrError):
        encode(message)


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("Int16", "", "starts with"),
        ("Int16", "00000000 0100", "starts with"),
        ("Int16", "00070000 0100", "starts with"),
        ("Int16", "00010000 01", "unpack_from"),
        ("Int16", "00010000 0100" + "00" * 65, "65 bytes too long"),
        ("String", "00010000 05000000 6100", "5 items in the last 2 bytes"),
        ("String", "00010000 ffffffff 6100", "4294967295 items"),
        ("String", "00010000 02000000 6161", "closing zero"),
        ("String", "00010000 03000000 c3c300", "utf-8"),
        ("Int16MultiArray", "00010000 ffffffff 00000000", "4294967295 items"),
        ("Int16MultiArray", "00010000 00000000 00000000 00000080 0000", "2147483648 items"),
    ],
)
def test_bytes_that_are_no_message_are_refused(name: str, data: str, reason: str) -> None:
    with pytest.raises(CdrError, match=reason):
        decode(f"std_msgs/msg/{name}", hexed(data))


def test_a_time_has_less_than_a_billion_nanoseconds() -> None:
    with pytest.raises(CdrError, match="1000000000 nanoseconds"):
        decode("rosgraph_msgs/msg/Clock", b"\0\1\0\0" + struct.pack("<iI", 0, 10**9))


SCAN_BYTES = encode(
    Scan(
        5_500_000,
        1,
        "SPEED",
        3,
        0,
        0,
        True,
        Values((1, 2), (0, 0), (1.0, 2.0), ("x",)),
        errors=(ScanError(10, 7001),) * 3,
    )
)


@settings(REPEATABLE, max_examples=400)
@given(st.integers(4, len(SCAN_BYTES) - 1), st.integers(0, 255), st.integers(0, len(SCAN_BYTES)))
def test_mutated_bytes_decode_or_are_refused(position: int, value: int, end: int) -> None:
    data = bytearray(SCAN_BYTES)
    data[position] = value
    for mutant in (bytes(data), bytes(data[:end])):
        with contextlib.suppress(CdrError):
            decoder("automax_msgs/msg/Scan")(mutant)


def in_parts(message: Any) -> bytes:
    """The bytes by the general way, part by part, which encoders take where something is rare."""
    out = bytearray(HEADER)
    _appender(NAMES[type(message)])(message, out)
    return bytes(out)


@pytest.mark.parametrize("name", ALL)
def test_packing_at_once_and_in_parts_give_the_same_bytes(name: str) -> None:
    @REPEATABLE
    @given(messages(name))
    def check(message: Any) -> None:
        assert in_parts(message) == encode(message)

    check()


@REPEATABLE
@given(st.lists(table_like(), min_size=4, max_size=4), st.text("ABCDEFGH", min_size=1, max_size=9))
def test_scans_and_writes_of_racks_are_packed_to_the_same_bytes(values: list[Values], task: str) -> None:
    scan = Scan(5_500_000_001, 3, task, 7, 1, 2, True, *values)
    write = CommonWrite(5_500_000_001, 77, 3, 1, 2, 9, values[0])
    for message in (scan, write):
        assert encode(message) == in_parts(message) == modelled(message)[0]


def test_encoders_in_one_step_refuse_what_does_not_fit() -> None:
    values = Values((70_000,), (0,), (1.0,))
    with pytest.raises(CdrError, match="Scan"):
        encode(Scan(0, 1, "A", 1, latched=values))
    with pytest.raises(CdrError, match="CommonWrite"):
        encode(CommonWrite(0, 1, 1, 1, 1, 1, values))


def test_empty_values_are_the_one_that_the_encoder_knows() -> None:
    scan: Any = decode("automax_msgs/msg/Scan", encode(Scan(0, 1, "A", 1, latched=Values((), (), (), ()))))
    assert scan.latched is NO_VALUES
    assert scan.committed is NO_VALUES


def test_a_plain_tuple_is_as_good_as_the_class() -> None:
    assert encoder("std_msgs/msg/Int16")((5,)) == encode(Int16(5))
    assert encoder("std_msgs/msg/String")(("text",)) == encode(String("text"))
    with pytest.raises(CdrError, match="Int16"):
        encoder("std_msgs/msg/Int16")((5, 6))
