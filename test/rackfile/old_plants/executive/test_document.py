"""The rack file while it is made: what its reader refuses is lessened, in few readings, and nothing else is."""

from __future__ import annotations

import pytest

from automax_ros.core.user_error import UserError
from automax_ros.core.yaml_text import MAX_NODES
from automax_ros.rackfile.model.module import MAX_TASKS
from automax_ros.rackfile.old_plants.executive import document
from automax_ros.rackfile.old_plants.executive.document import Document, Entry, ModuleEntry
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.reading.files import MAX_BYTES

HEAD = ["rack: PM1"]
MEMORY = ModuleEntry("0: {module: 57C413}", "$CARD.DBF", 1, slot=0, model="57C413", fixed=True)


def processor(tasks=()):
    return ModuleEntry("1: {module: 57C435}", "$CARD.DBF", 1, slot=1, model="57C435", tasks=list(tasks),
                       takes_tasks=True, fixed=True)  # fmt: skip


def common(number, options, plain="{}"):
    name = f"V{number}%"
    return Entry(f"{name}: {options}", "$SWVAR.DBF", number, plain=f"{name}: {plain}")


@pytest.fixture
def readings(monkeypatch):
    """The texts that the reader of rack files was given."""
    texts = []
    real = document.load_stored

    def read(source, *others):
        texts.append(source.text)
        return real(source, *others)

    monkeypatch.setattr(document, "load_stored", read)
    return texts


def settled(made):
    findings = Findings()
    return made.settle(findings), findings


def test_very_many_errors_take_as_many_readings_as_one(readings):
    inputs = ModuleEntry("5: {module: 57C419}", "$CARD.DBF", 2, slot=5, model="57C419")
    commons = [common(number, "{slot: 5, register: 9}") for number in range(3000)]
    made = Document(HEAD, [MEMORY, processor(), inputs], commons=commons)
    found, findings = settled(made)
    assert len(readings) == 2
    assert {item.code for item in found} == {"AMX6412"}
    assert {entry.level for entry in commons} == {document._PLAIN}
    assert (len(findings.items), findings.left_out, findings.has_errors) == (1000, 2000, False)


def test_all_tasks_that_are_too_many_are_left_out_at_once(readings):
    tasks = [Entry(f"T{number}: {{priority: 5}}", "$TASKS.DBF", number) for number in range(1000)]
    made = Document(HEAD, [MEMORY, processor(tasks)])
    found, findings = settled(made)
    assert len(readings) == 2
    assert (found, [task.is_comment for task in tasks]) == ([], [False] * MAX_TASKS + [True] * (1000 - MAX_TASKS))
    assert findings.errors == 1000 - MAX_TASKS


@pytest.mark.parametrize(
    ("count", "options", "message"),
    [
        (MAX_NODES // 4 + 1, "{unit: A}", "the rack file would have more than 100000 keys and values"),
        (MAX_BYTES // 100, f"{{description: {'X' * 100}}}", "the rack file would have more than 1000000 bytes"),
    ],
)
def test_a_file_that_is_too_large_is_refused_and_no_variable_pays_for_it(readings, count, options, message):
    commons = [common(number, options) for number in range(count)]
    with pytest.raises(UserError) as caught:
        settled(Document(HEAD, [MEMORY, processor()], commons=commons))
    assert (caught.value.message, caught.value.hint) == (message, "is this one rack?")
    assert len(readings) <= 1
    assert {entry.level for entry in commons} == {document._WHOLE}
