"""Texts of the databases are untrusted: whatever they say, they stay texts of the rack file and never its markup."""

from __future__ import annotations

import string

from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import printable
from automax_ros.core.yaml_text import read_data
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import chosen_rack
from automax_ros.rackfile.old_plants.executive.importing import Choices, import_rack
from rackfile.old_plants.executive.disks import CARD, SCAN, SWVAR, TASKS, card, memory, point, rack, table, task

PARTS = {1: "57C413", 2: "57C435", 10: "57C404"}
LONG = 60
MARKUP = [
    *("A, drop: 5", "A, depth: 3", "A}\n9: {module: 57C419", "!!python/name:os", "&A", "*A", "NULL", "no", "# A"),
    *("A # B", "'", '"', "- A", "A: B", "? A", "%A", "@A", "`A", *"[]{},|>", "---", "...", "<<: {A: 1}", "\t", "\0"),
]
HOSTILE = st.sampled_from(MARKUP) | st.text(alphabet=string.printable + "\x00\x1a\x7f\x85\xa0", max_size=20)
TEXTS = HOSTILE | st.builds("{}{}".format, HOSTILE, HOSTILE)
SYSTEM = [
    (name, "C", LONG)
    for name in ("ID", "DESC", "ENGINEER", "CUSTOMER", "SYSTEM_VER", "SECT_ID", "LOCATION", "RACK_PART")
]
KEYS = {
    "module", "network", "drop", "depth", "tick_ms", "tasks", "file", "priority", "drive", "critical", "slot",
    "register", "bit", "non_volatile", "description",
}  # fmt: skip


def shown(text):
    """A text of a table as a rack file has it."""
    return printable(text.rstrip(" \0")).strip()


def wide(fields):
    """The same fields with room for any text."""
    return [(name, "C", LONG) if kind == "C" else (name, kind, length) for name, kind, length in fields]


@given(st.data())
@settings(max_examples=150, deadline=None, derandomize=True, database=None)
def test_no_text_of_a_database_becomes_yaml_markup(tmp_path_factory, data):
    def text():
        return data.draw(TEXTS).encode("cp437", errors="replace").decode("cp437")[:LONG]

    system = tmp_path_factory.mktemp("hostile")
    folder = rack(system / "PM1", files={"LINE.BLK": SCAN.format("REF%")})
    for name in ("SYSTEM", "SECT", "RACK"):
        rows = [{"ID": "PM1" if name == "RACK" else text(), **{key: text() for key, *_ in SYSTEM[1:]}}]
        (system / f"${name}.DBF").write_bytes(table(SYSTEM, rows))
    network, description = text(), text()
    cards = [
        card(0, 1, DESC=text()),
        card(1, 2, DESC=text(), WIRE_NOTE1=21),
        card(4, 10, NETWORK=network, DESC=text(), NET_DROP=5),
        card(7, 99, NETWORK=text(), DESC=text()),
        card(8, 99, REM_DROP=1, DESC=text()),
    ]
    (folder / "$CARD.DBF").write_bytes(table(wide(CARD), cards))
    tasks = [task("LINE", DESC=text()), task(text(), kind=text(), DESC=text()), task("PC1", kind="PC", DESC=text())]
    (folder / "$TASKS.DBF").write_bytes(table(wide(TASKS), tasks))
    variables = [memory("REF", DESC=description), memory(text(), DESC=text()), point("A", 9, 0, DESC=text())]
    (folder / "$SWVAR.DBF").write_bytes(table(wide(SWVAR), variables))

    made = import_rack(chosen_rack(folder, None), Choices(parts=PARTS), Findings())
    tree = read_data(made.text)
    assert set(tree) == {"rack", "executive", "slots", "common"}, made.text
    assert set(tree["slots"]) <= {"0", "1", "4", "7"}
    inner = [*tree["slots"].values(), *tree["common"].values(), *tree["slots"]["1"]["tasks"].values()]
    assert {key for item in inner if item for key in item} <= KEYS
    config = load_stored(SourceText("rack.yaml", made.text), folder / "rack.yaml").config
    assert config is not None, made.text
    reference = config.declared[0]
    assert (reference.name, reference.description) == ("REF%", shown(description))
    if "4" in tree["slots"]:
        assert tree["slots"]["4"] == {"module": "57C404", "network": shown(network) or "NET", "drop": "5"}


def test_the_name_of_a_network_adds_no_key(tmp_path):
    cards = [card(0, 1), card(1, 2, WIRE_NOTE1=21), card(4, 10, NETWORK="A, depth: 3", NET_DROP=5)]
    folder = rack(tmp_path / "PM1", [], [task("LINE")], [memory("REF")], {"LINE.BLK": SCAN.format("REF%")})
    (folder / "$CARD.DBF").write_bytes(table(wide(CARD), cards))
    made = import_rack(chosen_rack(folder, None), Choices(parts=PARTS), Findings())
    assert set(read_data(made.text)["slots"]) == {"0", "1"}
    assert "  # 4: {module: 57C404, network: 'A, depth: 3', drop: 5}" in made.text
