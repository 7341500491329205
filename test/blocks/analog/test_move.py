import pytest
from compile.support import OTHER, WRITER, lines, ran, run_scans, scan_in_steps, task_of
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.kinds import WriteKind
from automax_ros.runtime.tasks.task import Task
from blocks.support import int16, repeatable, run


@pytest.fixture(params=["at once", "in steps"])
def scan(request):
    """Both forms of a scan."""
    return Task.scan if request.param == "at once" else scan_in_steps


@pytest.mark.parametrize("count", range(1, 9))
def test_moves_each_input_to_its_output(count):
    block = run("MOVE")
    inputs = {f"input{n}": n * 1000 - 5 for n in range(1, count + 1)}
    result = block.scan(**inputs)
    assert {name: value for name, value in result.items() if value} == {
        f"output{n}": n * 1000 - 5 for n in range(1, count + 1)
    }


@repeatable
@given(st.lists(int16, min_size=8, max_size=8), st.lists(int16, min_size=8, max_size=8), st.booleans())
def test_moves_all_or_nothing(inputs, before, enable):
    block = run("MOVE")
    block.outputs.update({f"output{n}": value for n, value in enumerate(before, 1)})
    result = block.scan(enable=enable, **{f"input{n}": value for n, value in enumerate(inputs, 1)})
    assert list(result.values()) == (inputs if enable else before)


def test_it_has_no_copy_of_its_own():
    """What another writes into an output stays while ENABLE is FALSE."""
    block = run("MOVE")
    assert block.scan(input1=5)["output1"] == 5
    block.outputs["output1"] = 77
    assert block.scan(input1=6, enable=False)["output1"] == 77
    assert block.scan(input1=6, enable=True)["output1"] == 6
    assert block.state == {}


MOVING = """10 COMMON EN@, REF%, OUT%, T%(3)
20 CALL SCAN_LOOP(TICKS=4)
30 CALL MOVE(ENABLE=EN@, INPUT1=REF%, OUTPUT1=OUT%, INPUT2=REF%, OUTPUT2=T%(1))
40 END
"""


def read(memory, name, element=0):
    return memory.read_now(memory.view(name), element)


def write(memory, name, value, element=0):
    memory.write_from_outside(memory.view(name), value, OTHER, element)


def test_while_enable_is_false_the_variables_stay_as_others_wrote_them(scan):
    task, memory = task_of(MOVING, **{"EN@": True, "REF%": 5})
    task.run()
    scan(task, 1)
    assert (read(memory, "OUT%"), read(memory, "T%", 1)) == (5, 5)
    write(memory, "EN@", False)
    write(memory, "OUT%", 77)
    write(memory, "T%", 88, 1)
    memory.keep_log()
    scan(task, 2)
    scan(task, 3)
    assert (read(memory, "OUT%"), read(memory, "T%", 1)) == (77, 88)
    assert memory.drain() == []
    write(memory, "EN@", True)
    scan(task, 4)
    assert (read(memory, "OUT%"), read(memory, "T%", 1)) == (5, 5)
    writes = {(entry.kind, entry.value) for entry in memory.drain() if entry.writer == WRITER}
    assert writes == {(WriteKind.COMMIT, 5), (WriteKind.BASIC, 5)}


def test_an_output_forced_and_released_does_not_return(scan):
    """Section 17 note 2."""
    task, memory = task_of(MOVING, **{"EN@": True, "REF%": 5})
    task.run()
    scan(task, 1)
    write(memory, "EN@", False)
    memory.force(memory.view("OUT%"), 42)
    scan(task, 2)
    memory.release(memory.view("OUT%"))
    scan(task, 3)
    assert read(memory, "OUT%") == 42
    write(memory, "EN@", True)
    scan(task, 4)
    assert read(memory, "OUT%") == 5


def test_basic_may_write_the_output_of_a_move_that_is_not_enabled():
    task = ran("A% = A% + 1", "CALL MOVE(ENABLE=X@, INPUT1=500, OUTPUT1=A%)", scans=3)
    assert task.value("A%") == 3


@pytest.mark.parametrize("scope", ["LOCAL", "COMMON"])
def test_two_variables_exchange_their_values(scope):
    text = f"""10 {scope} A%, B%
20 A% = 3 \\ B% = 7
30 CALL SCAN_LOOP(TICKS=4)
40 CALL MOVE(INPUT1=A%, OUTPUT1=B%, INPUT2=B%, OUTPUT2=A%)
50 END
"""
    task, memory = task_of(text)
    value = task.value if scope == "LOCAL" else lambda name: read(memory, name)
    run_scans(task, 1)
    assert (value("A%"), value("B%")) == (7, 3)


def test_elements_of_an_array_move_all_at_once():
    task = ran(
        "T%(0) = 1 \\ T%(1) = 2 \\ T%(2) = 3",
        "CALL MOVE(INPUT1=T%(0), OUTPUT1=T%(1), INPUT2=T%(1), OUTPUT2=T%(2), INPUT3=T%(2), OUTPUT3=T%(0))",
    )
    assert task.value("T%")[:3] == [3, 1, 2]


NAMES = [f"V{n}%" for n in range(8)]


@settings(parent=repeatable, max_examples=40)
@given(st.lists(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)), min_size=1, max_size=8), st.randoms())
def test_any_pairs_move_as_a_tuple_assignment_does(pairs, random):
    """All inputs are read before an output is written; of two writes to one variable the last of the CALL stays."""
    values = {name: number * 11 + 1 for number, name in enumerate(NAMES)}
    places = list(range(len(pairs)))
    random.shuffle(places)
    expected = values | {pairs[n][1]: values[pairs[n][0]] for n in places}
    parameters = [f"OUTPUT{n + 1}={pairs[n][1]}" for n in places]
    for n, (source, _) in enumerate(pairs, 1):
        parameters.insert(random.randint(0, len(parameters)), f"INPUT{n}={source}")
    start = " \\ ".join(f"{name} = {value}" for name, value in values.items())
    text = lines(start, f"CALL MOVE({', '.join(parameters)})", declare=f"LOCAL {', '.join(NAMES)}")
    task, _ = task_of(text)
    run_scans(task, 1)
    assert {name: task.value(name) for name in NAMES} == expected
