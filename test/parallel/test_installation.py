"""What machines compare before they work on one thing: each part of it, down to the last bit of a sine."""

import math
import pickle
import platform

import numpy as np
import pytest

from automax_ros.parallel import installation as module
from automax_ros.parallel.installation import WorkerInstallation, installation, results_digest


def test_all_that_decides_on_results_is_told():
    found = installation()
    assert found.python.endswith(platform.python_version())
    assert found.numpy == np.__version__
    assert found.results == results_digest()
    assert pickle.loads(pickle.dumps(found)) == found


@pytest.mark.parametrize("function", range(len(module._MATH)))
def test_the_last_bit_of_one_value_of_a_function_is_seen(monkeypatch, function):
    own = module._MATH[function]

    def other(argument):
        value = own(argument)
        return math.nextafter(value, math.inf) if argument == 1.0 * 5 / 7 else value

    before = results_digest()
    monkeypatch.setattr(module, "_MATH", (*module._MATH[:function], other, *module._MATH[function + 1 :]))
    assert results_digest() != before


def test_the_last_bit_of_a_sum_by_numpy_is_seen(monkeypatch):
    before = results_digest()
    others = [np.nextafter(np.add.reduce(np.array(module._ARGUMENTS)), np.inf)]
    monkeypatch.setattr(module, "_NUMPY", (*module._NUMPY[:-1], lambda _: others[0]))
    assert results_digest() != before


def test_an_older_version_that_tells_less_is_unlike():
    older = WorkerInstallation.__new__(WorkerInstallation)
    vars(older).update(version="0.0.9", sources="0" * 64)
    assert older != installation()
    assert str(older) == "0.0.9 (sources 000000000000)"
