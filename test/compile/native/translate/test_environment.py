"""What is known of names, against plain dictionaries."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from automax_ros.compile.native.translate import environment
from automax_ros.compile.native.translate.environment import Environment, joined
from automax_ros.compile.native.translate.ranges import NumberKind, Range

NAMES = "abcdefgh"
Model = dict[str, Range]
ranges = st.builds(lambda low, size: Range(NumberKind.INT, low, low + size), st.integers(-3, 3), st.integers(0, 3))
steps = st.lists(
    st.tuples(
        st.sampled_from(["set", "drop", "fork", "join", "read"]),
        st.integers(0, 7),
        st.integers(0, 7),
        st.sampled_from(NAMES),
        ranges,
    ),
    max_size=60,
)


def met(first: Model, second: Model) -> Model:
    """What plain dictionaries say of two paths that meet."""
    return {
        name: Range(NumberKind.INT, min(item.low, second[name].low), max(item.high, second[name].high))
        for name, item in first.items()
        if name in second
    }


def assert_alike(known: Environment, model: Model) -> None:
    assert dict(known.items()) == model
    assert [name for name in NAMES if name in known] == [name for name in NAMES if name in model]
    assert [known.get(name) for name in NAMES] == [model.get(name) for name in NAMES]


@given(st.dictionaries(st.sampled_from(NAMES), ranges), steps, st.sampled_from([0, 1, 3, 128]))
def test_it_knows_what_dictionaries_know(base: Model, actions: list, most: int) -> None:
    """Paths fork, set names, lose names and meet; none of it shows in another path."""
    usual, environment._MOST_CHANGES = environment._MOST_CHANGES, most
    try:
        paths = [(Environment(dict(base)), dict(base))]
        for action, one, other, name, item in actions:
            (known, model), (there, there_model) = paths[one % len(paths)], paths[other % len(paths)]
            if action == "set":
                paths.append((known.setting(name, item), {**model, name: item}))
            elif action == "drop":
                left = {key: value for key, value in model.items() if key not in {name, "a"}}
                paths.append((known.without({name, "a"}), left))
            elif action == "fork":
                paths.append((known.copy(), dict(model)))
                paths[-1][0][name] = item
                paths[-1][1][name] = item
            elif action == "join":
                paths.append((known.joined(there), met(model, there_model)))
            else:
                told = {key: (before, after) for key, before, after in known.differing(there)}
                for key in NAMES:
                    if model.get(key) != there_model.get(key):
                        assert told[key] == (model.get(key), there_model.get(key))
        for known, model in paths:
            assert_alike(known, model)
    finally:
        environment._MOST_CHANGES = usual


def test_where_no_path_comes_from_nothing_is_known() -> None:
    known = Environment({"a": Range(NumberKind.INT, 0, 1)})
    assert joined(None, None) is None
    assert joined(known, None) is joined(None, known) is known
