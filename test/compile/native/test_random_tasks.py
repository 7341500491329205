"""Random tasks: compiled code against an independent interpreter, and the two forms of a scan against each other."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from soaking import holds_for

from automax_ros.compile.compiler import compile_program
from automax_ros.core.types import DataType
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.tasks.task import Task
from compile.interpreter import Interpreter
from compile.programs import checked, outside_writes, tasks
from compile.support import OTHER, WRITER, repeatable, scan_and_record, scan_in_steps, views_of

HISTORY = st.lists(outside_writes(), min_size=3, max_size=3)
TUNINGS = {"G%", "H"}


def installed(program) -> tuple[Task, CommonMemory]:
    memory = CommonMemory(views_of(program))
    compiled = compile_program(program, {spec.name: view for view, spec in enumerate(memory.specs)})
    task = Task(compiled, memory, writer=WRITER)
    task.record_scans()
    memory.keep_log()
    return task, memory


def bits(value: object) -> object:
    """A value with its type; floats by their bits, so that -0.0 is not 0.0."""
    if isinstance(value, list):
        return [bits(item) for item in value]
    return (type(value), value.hex() if isinstance(value, float) else value)


def local_values(task: Task, names) -> dict[str, object]:
    return {name: bits(task.value(name)) for name in names}


def written(memory: CommonMemory) -> list[tuple[str, str, int, object]]:
    entries = [entry for entry in memory.drain() if entry.writer == WRITER]
    return [(entry.kind.name, memory.specs[entry.view].name, entry.element, bits(entry.value)) for entry in entries]


@holds_for(40, tasks(), HISTORY, soak=(3000, (tasks(4), HISTORY)))
def test_compiled_tasks_do_what_the_interpreter_does(text, history) -> None:
    program = checked(text)
    task, memory = installed(program)
    model = Interpreter(program)
    record = task.run(0)
    model.run()
    compare(task, memory, model, record)
    for now, writes in enumerate(history, 1):
        for name, value in writes.items():
            memory.write_from_outside(memory.view(name), value, OTHER)
            model.commons[name] = value
        record = task.scan(now)
        model.scan()
        compare(task, memory, model, record)


def compare(task: Task, memory: CommonMemory, model: Interpreter, record) -> None:
    assert record.errors == model.log
    assert local_values(task, model.locals) == {name: bits(value) for name, value in model.locals.items()}
    assert written(memory) == [(kind, name, element, bits(value)) for kind, name, element, value in model.writes]
    assert list(task.printed) == model.printed
    model.log.clear()
    model.writes.clear()


@holds_for(25, tasks(), HISTORY, soak=(1500, (tasks(4), HISTORY)))
def test_both_forms_of_a_scan_agree(text, history) -> None:
    program = checked(text)
    (at_once, memory), (in_steps, other) = installed(program), installed(program)
    at_once.run(0)
    in_steps.run(0)
    for now, writes in enumerate(history, 1):
        for name, value in writes.items():
            memory.write_from_outside(memory.view(name), value, OTHER)
            other.write_from_outside(other.view(name), value, OTHER)
        record = at_once.scan(now)
        costs, record_in_steps = scan_and_record(in_steps, now)
        assert sum(costs) == 0
        assert record_in_steps == record
        assert other.drain() == memory.drain()
        assert list(map(bits, in_steps.snapshot())) == list(map(bits, at_once.snapshot()))
        assert (in_steps.printed, in_steps.status) == (at_once.printed, at_once.status)


@holds_for(25, tasks(), HISTORY, soak=(1500, (tasks(4), HISTORY)))
def test_asking_for_the_state_changes_nothing(text, history) -> None:
    """Between scans the compiled code holds the state: whether anybody looks must make no difference."""
    program = checked(text)
    (asked, memory), (left_alone, other) = installed(program), installed(program)
    left_alone.record_scans(on=False)
    asked.run(0)
    left_alone.run(0)
    for now, writes in enumerate(history * 3, 1):
        for name, value in writes.items():
            memory.write_from_outside(memory.view(name), value, OTHER)
            other.write_from_outside(other.view(name), value, OTHER)
        asked.scan(now)
        asked.snapshot()
        left_alone.scan(now)
    assert other.drain() == memory.drain()
    assert list(map(bits, left_alone.snapshot())) == list(map(bits, asked.snapshot()))
    assert (left_alone.printed, left_alone.status) == (asked.printed, asked.status)


FORCED = outside_writes().map(
    lambda values: {name: value for name, value in values.items() if name[-1] in "%!@" and name[:-1].isalpha()}
)


@holds_for(40, tasks(), HISTORY, FORCED, soak=(1500, (tasks(4), HISTORY, FORCED)))
def test_forced_commons_keep_their_value_inside_a_scan_too(text, history, forced) -> None:
    """From the second scan on commons are forced, after the third no longer."""
    program = checked(text)
    (task, memory), (in_steps, other) = installed(program), installed(program)
    model = Interpreter(program)
    for one in (task, in_steps, model):
        one.run()
    compare(task, memory, model, task._io.record)
    other.drain()
    for now, writes in enumerate(history * 2, 1):
        for name, value in forced.items() if now == 2 else ():
            memory.force(memory.view(name), value, writer=OTHER)
            other.force(other.view(name), value, writer=OTHER)
            model.commons[name] = value
            model.forced.add(name)
        for name in forced if now == 4 else ():
            memory.release(memory.view(name), writer=OTHER)
            other.release(other.view(name), writer=OTHER)
            model.forced.clear()
        for name, value in writes.items():
            memory.write_from_outside(memory.view(name), value, OTHER)
            other.write_from_outside(other.view(name), value, OTHER)
            if name not in model.forced:
                model.commons[name] = value
        record = task.scan(now)
        model.scan()
        scan_in_steps(in_steps, now)
        compare_states(task, in_steps)
        assert other.drain() == [entry for group in memory._log or [] for entry in group.entries()]
        compare(task, memory, model, record)


def compare_states(one: Task, other: Task) -> None:
    assert list(map(bits, other.snapshot())) == list(map(bits, one.snapshot()))


@given(tasks(), HISTORY, st.integers(0, 2))
@repeatable(15)
def test_a_snapshot_goes_on_as_the_task_would_have(text, history, after):
    program = checked(text)
    task, memory = installed(program)
    task.run(0)
    for now, writes in enumerate(history):
        if now == after:
            snapshot, image, number, status = task.snapshot(), memory.image(), task.scan_number, task.status
        for name, value in writes.items():
            memory.write_from_outside(memory.view(name), value, OTHER)
        task.scan(now)
    twin, twin_memory = installed(program)
    twin_memory.load_image(image)
    twin.restore(snapshot)
    twin.scan_number, twin.status = number, status
    assert list(map(bits, twin.snapshot())) == list(map(bits, snapshot))
    for now, writes in list(enumerate(history))[after:]:
        for name, value in writes.items():
            twin_memory.write_from_outside(twin_memory.view(name), value, OTHER)
        twin.scan(now)
    assert list(map(bits, twin.snapshot())) == list(map(bits, task.snapshot()))
    assert twin_memory.image() == memory.image()
    assert {field.type for field in task.layout.fields} <= set(DataType)
