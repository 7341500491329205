"""Which values runs have: grids, lists, samples; names and ranges that are refused."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from automax_ros.core.numbers import stored_real
from automax_ros.core.user_error import UserError
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.sweep import points
from automax_ros.sweep.points import grid, read_varied, sample
from sweep.helpers import rack_in

DRIVE = Path(__file__).parents[2] / "config" / "dc_drive" / "rack.yaml"


@pytest.fixture(scope="module")
def rack(tmp_path_factory: pytest.TempPathFactory) -> Rack:
    return rack_in(Path(tmp_path_factory.mktemp("points")))


@pytest.fixture(scope="module")
def drive() -> Rack:
    config = load(DRIVE).config
    assert config is not None
    return Rack(config)


def single(text: str) -> float:
    return stored_real(float(text))[0]


@pytest.mark.parametrize(
    ("text", "label", "values"),
    [
        ("loop.kp=0.5:1.5:5", "LOOP.KP", (0.5, 0.75, 1.0, 1.25, 1.5)),
        ("LOOP.KP=0.1:0.4:4", "LOOP.KP", tuple(map(single, ("0.1", "0.2", "0.3", "0.4")))),
        ("LOOP.STEPS=0:9:4", "LOOP.STEPS", (0, 3, 6, 9)),
        ("LOOP.STEPS%=0:3:20", "LOOP.STEPS", (0, 1, 2, 3)),
        ("ref%=500, 1000,500", "REF%", (500, 1000)),
        ("TABLE%(2)=-1:1:3", "TABLE%(2)", (-1, 0, 1)),
        ("RUN@=true,off", "RUN@", (True, False)),
        ("NOTE$=a:b,c", "NOTE$", ("a:b", "c")),
        ("SLOW=8", "SLOW", (8.0,)),
    ],
)
def test_values_of_a_quantity(rack: Rack, text: str, label: str, values: tuple[object, ...]):
    varied = read_varied(rack, text)
    assert varied.quantity.label == label
    assert varied.values == values
    assert [varied.variable.accepted(varied.quantity.text(value)) for value in values] == list(values)


def test_numbers_of_plants(drive: Rack):
    varied = read_varied(drive, "MOTOR.load.torque_nm=0:0.3:4")
    assert varied.values == (0.0, 0.1, 0.2, 0.3)
    assert [varied.quantity.text(value) for value in varied.values] == ["0.0", "0.1", "0.2", "0.3"]
    exact = single("0.1")
    assert float(varied.quantity.text(exact)) == exact


def test_a_grid_is_every_combination_the_last_quantity_fastest(rack: Rack):
    varied = [read_varied(rack, text) for text in ("REF%=1,2", "LOOP.STEPS=3", "SLOW=1:2:3")]
    assert grid(varied) == [(ref, 3, slow) for ref in (1, 2) for slow in (1.0, 1.5, 2.0)]
    assert grid([]) == [()]


def test_a_sample_has_one_point_in_each_part_of_each_range(rack: Rack):
    varied = [read_varied(rack, text) for text in ("LOOP.KP=0.1:2.1", "REF%=0:9999", "SLOW=1,2,3,4", "RUN@=0,1")]
    found = np.array(sample(varied, 200, 7), float)
    assert found.shape == (200, 4)
    assert sorted(np.floor((found[:, 0] - 0.1) / 2 * 200 + 1e-6).astype(int)) == list(range(200))
    assert sorted(found[:, 1] // 50) == list(range(200))
    assert [np.count_nonzero(found[:, 2] == value) for value in (1, 2, 3, 4)] == [50] * 4
    assert np.count_nonzero(found[:, 3]) == 100
    assert sample(varied, 200, 7) == sample(varied, 200, 7) != sample(varied, 200, 8)


def test_points_that_are_the_same_occur_once(rack: Rack):
    found = sample([read_varied(rack, "LOOP.STEPS=2:4")], 60, 1)
    assert sorted(found) == [(2,), (3,), (4,)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("REF%", "'REF%' contains no values"),
        ("REF%=", "'REF%=' contains no values"),
        ("REFF%=1", "the rack has no common variable 'REFF%'"),
        ("TABLE%=1", "TABLE% is an array"),
        ("LOPO.KP=1", "the rack has no task and no plant 'LOPO'"),
        ("LOOP.KPP=1", "task LOOP has no tunable 'KPP'"),
        ("LOOP.NIL=1", "task LOOP has no tunable 'NIL'"),
        ("LOOP.KP=0.1:3:5", "LOOP.KP = 3 lies outside 0.1 to 2.5"),
        ("LOOP.STEPS=1.5", "'1.5' is not a value for STEPS%, type INTEGER"),
        ("REF%=0:40000:3", "'40000' is not a value for REF%, type INTEGER"),
        ("REF%=5:1:3", "REF%: 5 is not below 1"),
        ("REF%=1:5:1", "REF%: '1' values: a range has 2 to 100000"),
        ("REF%=1:5:2.5", "REF%: '2.5' values: a range has 2 to 100000"),
        ("REF%=1:5:x", "REF%: 'x' is not a number"),
        ("REF%=1:2:3:4", "'REF%=1:2:3:4' has too many colons"),
        ("BATTERYSTATUS0@=1", "the rack has no common variable 'BATTERYSTATUS0@'"),
    ],
)
def test_what_is_refused(rack: Rack, text: str, message: str):
    with pytest.raises(UserError) as caught:
        read_varied(rack, text)
    assert caught.value.message == message


def test_numbers_of_plants_have_the_limits_of_the_rack_file(drive: Rack):
    with pytest.raises(UserError, match=r"MOTOR\.inertia = 0 lies outside 1 to 10000"):
        read_varied(drive, "MOTOR.inertia=0:5:3")
    with pytest.raises(UserError, match=r"plant MOTOR has no number 'load\.torq'"):
        read_varied(drive, "MOTOR.load.torq=1")


def test_a_grid_needs_numbers_of_values_and_is_not_endless(rack: Rack, monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(UserError, match=r"LOOP\.KP has two ends and no number of values"):
        grid([read_varied(rack, "LOOP.KP=0.1:2")])
    monkeypatch.setattr(points, "MOST_RUNS", 99)
    varied = [read_varied(rack, "REF%=1:50:50"), read_varied(rack, "SLOW=1,2")]
    with pytest.raises(UserError, match="100 runs: a sweep has at most 99"):
        grid(varied)
    with pytest.raises(UserError, match="100 runs: a sweep has at most 99"):
        sample(varied, 100, 1)


def test_not_too_many_quantities_vary(rack: Rack, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(points, "MOST_QUANTITIES", 2)
    varied = [read_varied(rack, text) for text in ("REF%=1,2", "LOOP.STEPS=3", "SLOW=1,2")]
    assert len(grid(varied[:2])) == len(sample(varied[:2], 2, 1)) == 2
    for refused in (lambda: grid(varied), lambda: sample(varied, 10, 1)):
        with pytest.raises(UserError, match="3 quantities: a sweep has at most 2"):
            refused()


def test_a_share_of_one_is_the_last_value(rack: Rack, monkeypatch: pytest.MonkeyPatch):
    """The shares of scipy are (n - u) / n with u from 0: the greatest may be 1."""
    monkeypatch.setattr(qmc.LatinHypercube, "random", lambda _, count: np.ones((count, 3)))
    varied = [read_varied(rack, text) for text in ("LOOP.KP=0.1:2.1", "REF%=0:9999", "SLOW=1,2,3,4")]
    assert sample(varied, 1, 1) == [(single("2.1"), 9999, 4.0)]


def test_a_tunable_without_its_task_gets_the_name_that_is_meant(rack):
    with pytest.raises(UserError) as caught:
        read_varied(rack, "STEPS=1,2")
    assert caught.value.hint == "a tunable belongs to its task: write LOOP.STEPS"
