"""The table of message types against msg_defs, rosbags and the installed ROS packages; parsing of definitions."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from automax_ros.core import kinds
from automax_ros.core.types import DataType
from automax_ros.messages.types import messages
from automax_ros.messages.types.definitions import (
    MAX_SCHEMA_BYTES,
    TIME,
    Constant,
    DefinitionError,
    Field,
    message_types,
    parse_definition,
    parse_schema,
    same_layout,
    schema_text,
)

ROOT = Path(__file__).resolve().parents[3]
DEFINITIONS = ROOT / "msg_defs"


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location(
        "generate_message_types", ROOT / "tools" / "generate_message_types.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_table_is_what_the_tool_writes_today() -> None:
    module = generator()
    assert module.TARGET.read_text(encoding="utf-8") == module.generate()


def test_every_own_definition_stands_in_the_table_word_for_word() -> None:
    own = {path.stem: path.read_text() for path in DEFINITIONS.glob("msg/*.msg")}
    unrecorded = generator().SERVED | generator().LIVE
    assert own.keys() >= unrecorded
    for stem in own.keys() - unrecorded:
        assert message_types()[f"automax_msgs/msg/{stem}"].text == own[stem]


def test_what_only_services_answer_with_is_in_no_recording() -> None:
    answers = "".join(path.read_text().partition("---")[2] for path in DEFINITIONS.glob("srv/*.srv"))
    for stem in generator().SERVED:
        assert f"{stem}[]" in answers
        assert f"automax_msgs/msg/{stem}" not in message_types()
    for stem in generator().LIVE:
        assert f"{stem}[]" not in answers
        assert f"automax_msgs/msg/{stem}" not in message_types()


@pytest.mark.parametrize("path", sorted(DEFINITIONS.glob("srv/*.srv")), ids=lambda path: path.stem)
def test_services_are_described_in_full(path: Path) -> None:
    """What it does, then each field, or group of fields, after its description."""
    request, _, response = path.read_text().partition("---\n")
    assert request.startswith("# ")
    assert response.startswith(("# FALSE: ", "string rack"))
    for part in (request.partition("\n\n")[2], response):
        before = ""
        for line in part.splitlines():
            assert not line or line.startswith("#") or before, f"{line}: nothing says what it is"
            before = line


@pytest.mark.parametrize("path", sorted(DEFINITIONS.glob("srv/*.srv")), ids=lambda path: path.stem)
def test_services_are_built_with_the_fields_of_their_definitions(path: Path) -> None:
    service = getattr(importlib.import_module("automax_msgs.srv"), path.stem)
    for part, text in zip((service.Request, service.Response), path.read_text().split("---"), strict=True):
        lines = [line.split() for line in text.splitlines() if line.strip() and not line.startswith("#")]
        assert list(part.get_fields_and_field_types()) == [name for _, name in lines]


def test_each_generator_gets_a_copy_of_what_is_parsed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A generator that changes its tree changes no other's, and the file is read once."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    parser, definition = (
        importlib.import_module("rosidl_parser.parser"),
        importlib.import_module("rosidl_parser.definition"),
    )
    read: list[object] = []

    def parse(locator: object, png_file: str | None = None) -> list[object]:
        read.append(locator)
        return [str(locator.get_absolute_path())]

    monkeypatch.setattr(parser, "parse_idl_file", parse)
    importlib.import_module("message_code")._parse_once()
    places = [definition.IdlLocator(tmp_path, f"msg/{name}.idl") for name in ("One", "Two", "One")]
    trees = [parser.parse_idl_file(place) for place in places]
    trees[0].append("changed")
    assert trees[1:] == [[str(tmp_path / "msg" / "Two.idl")], [str(tmp_path / "msg" / "One.idl")]]
    assert read == places[:2]


def test_parts_that_are_compiled_at_once_have_each_source_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    sizes = {"a.c": 60, "b.c": 60, "c.c": 10, "d.c": 200, "e.c": 5}
    for file, size in sizes.items():
        (tmp_path / file).write_text("x" * size)
    expected = [["a.c", "b.c"], ["c.c", "d.c"], ["e.c"]]
    parts = importlib.import_module("compiler_parts").parts([tmp_path / file for file in sizes], 100)
    assert [[path.name for path in part] for part in parts] == expected

    tool = importlib.import_module("build_compiled")
    monkeypatch.setattr(tool, "PART_BYTES", 100)
    texts = [(tmp_path / part).read_text() for part in tool.part_files(tmp_path, list(sizes))]
    assert [re.findall(r'#include "(.*)"', text) for text in texts] == expected


@pytest.mark.soak
@pytest.mark.timeout(1200)
def test_a_fresh_build_makes_messages_and_services(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the definitions alone: five libraries and an extension, in which each service has its type support."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    code, libraries = importlib.import_module("message_code"), importlib.import_module("message_libraries")
    build = importlib.import_module("build_messages")
    package = code.Interfaces(build.NAME, build.SOURCE, tmp_path, build.PREFIX, build.DEPENDENCIES)
    code.generate(package)
    built = libraries.build_libraries(package)
    assert len(built) == 6
    symbols = b"".join(path.read_bytes() for path in built)
    for path in DEFINITIONS.glob("srv/*.srv"):
        assert f"get_service_type_support_handle__automax_msgs__srv__{path.stem}".encode() in symbols


def test_installed_services_are_those_of_today_and_known_to_ros() -> None:
    listing = Path("share") / "ament_index" / "resource_index" / "rosidl_interfaces" / "automax_msgs"
    prefix = next(prefix for prefix in generator().ros_prefixes() if (prefix / listing).is_file())
    listed = set((prefix / listing).read_text().splitlines())
    for path in DEFINITIONS.glob("srv/*.srv"):
        assert (prefix / "share" / "automax_msgs" / "srv" / path.name).read_text() == path.read_text()
        assert {f"srv/{path.stem}.{suffix}" for suffix in ("srv", "idl", "json")} <= listed


def test_hashes_are_those_of_rosbags_for_jazzy() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    standard = [name for name in message_types() if not name.startswith("automax_msgs")]
    assert len(standard) == 17
    assert {name: message_types()[name].hash for name in standard} == {
        name: store.hash_rihs01(name) for name in standard
    }


def test_hashes_are_those_of_the_installed_packages() -> None:
    module = generator()
    checked = 0
    for name, kind in message_types().items():
        path = module.installed_file(name, ".json")
        if path is not None:
            hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(path.read_text())["type_hashes"]}
            assert kind.hash == hashes[name]
            checked += 1
    assert checked >= 13


@pytest.mark.parametrize("name", sorted(messages.CLASSES))
def test_classes_have_the_fields_of_their_definitions(name: str) -> None:
    fields = [field.name for field in message_types()[name].definition.fields]
    assert list(messages.CLASSES[name]._fields) == fields  # type: ignore[attr-defined]


def test_only_the_time_has_no_class() -> None:
    assert set(message_types()) - set(messages.CLASSES) == {TIME}


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("CommonWrite", kinds.WriteKind),
        ("Writer", kinds.WriterKind),
    ],
)
def test_enumerations_are_the_constants(name: str, values: type) -> None:
    constants = message_types()[f"automax_msgs/msg/{name}"].definition.constants
    assert {item.name: int(item.value) for item in constants} == {item.name: item.value for item in values}  # type: ignore[attr-defined]


def test_enumerations_of_variables_are_the_constants() -> None:
    constants = message_types()["automax_msgs/msg/Variable"].definition.constants
    both = {kind.word.replace(" ", "_"): kind.number for kind in DataType}
    both |= {item.name: int(item) for item in kinds.Direction}
    assert {item.name: int(item.value) for item in constants} == both


@pytest.mark.parametrize("name", sorted(message_types()))
def test_schema_is_complete_for_rosbags(name: str) -> None:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_text(name), name))
    assert store.hash_rihs01(name) == message_types()[name].hash


def test_schema_separates_dependencies_by_80_signs_and_the_short_name() -> None:
    lines = schema_text("automax_msgs/msg/Scan").splitlines()
    heads = [lines[index + 1] for index, line in enumerate(lines) if line == "=" * 80]
    assert heads == ["MSG: builtin_interfaces/Time", "MSG: automax_msgs/Values", "MSG: automax_msgs/ScanError"]


def test_definition_with_everything() -> None:
    definition = parse_definition(
        "pkg/msg/T",
        "# remark\n\nint32 A=5\nstring B = 'x # y'\nuint8 plain 7\nstring<=10 name\nfloat64[3] fixed\nint8[<=4] few # r"
        "\nOther[] others\nstd_msgs/String s\nstd_msgs/msg/Int16 i\n",
    )
    assert definition.constants == (Constant("A", "int32", "5"), Constant("B", "string", "'x # y'"))
    assert definition.fields == (
        Field("plain", "uint8"),
        Field("name", "string", bound=10),
        Field("fixed", "float64", "[3]"),
        Field("few", "int8", "[<=4]"),
        Field("others", "pkg/msg/Other", "[]"),
        Field("s", "std_msgs/msg/String"),
        Field("i", "std_msgs/msg/Int16"),
    )


@pytest.mark.parametrize("text", ["int32", "int32 5a", "a/b/c/d e", "int32[x] a", "=", "\x00", "string<=x a"])
def test_what_is_no_definition_is_refused(text: str) -> None:
    with pytest.raises(DefinitionError):
        parse_definition("pkg/msg/T", text)


@pytest.mark.parametrize(
    "text",
    [
        "int32 a\n" + "=" * 80 + "\nint32 b",
        "int32 a\n" + "=" * 80,
        "=" * 80 + "\nMSG: ???\n",
        " " * (MAX_SCHEMA_BYTES + 1),
    ],
)
def test_what_is_no_schema_is_refused(text: str) -> None:
    with pytest.raises(DefinitionError):
        parse_schema("pkg/msg/T", text)


def test_layout_is_compared_without_remarks_and_with_nested_types() -> None:
    name = "automax_msgs/msg/CommonImage"
    text = schema_text(name)
    assert same_layout(name, parse_schema(name, text))
    assert same_layout(name, parse_schema(name, text.replace("# All of common memory", "# Anything")))
    assert same_layout(
        name, parse_schema(name, text.replace("MSG: automax_msgs/Values", "MSG: automax_msgs/msg/Values"))
    )
    assert not same_layout(name, parse_schema(name, text.replace("uint32[] element", "uint16[] element")))
    assert not same_layout(name, parse_schema(name, text.replace("uint64 run_id", "uint64 run")))
    assert not same_layout(name, parse_schema(name, text.split("=" * 80)[0]))
