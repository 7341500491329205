"""Records of scans: compared by what they say, copied whole, as observers keep them."""

import copy
import pickle

import pytest

from automax_ros.runtime.scan.scan_record import ScanRecord


def record():
    made = ScanRecord(5_500_000, 3, skipped=2)
    made.latched = (1, True, -7)
    made.reads.append((4, 0, 2.5))
    made.writes.append((5, 1, "text"))
    made.commits = [(6, False)]
    made.errors.append((40, 7026))
    made.duration_ns = 1234
    return made


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda made: pickle.loads(pickle.dumps(made))])
def test_a_copy_says_the_same(copied):
    made = record()
    other = copied(made)
    assert other == made
    assert repr(other) == repr(made)
    other.duration_ns += 1
    assert (other != made, made.duration_ns) == (True, 1234)


def test_a_deep_copy_has_lists_of_its_own():
    made = record()
    other = copy.deepcopy(made)
    made.reads.append((4, 0, 3.5))
    made.errors.clear()
    assert (other.reads, other.errors) == ([(4, 0, 2.5)], [(40, 7026)])


@pytest.mark.parametrize("name", ["time_ns", "scan", "skipped", "duration_ns"])
def test_each_number_counts_in_a_comparison(name):
    other = record()
    setattr(other, name, 99)
    assert other != record()
    assert record() != "a record"


def test_what_changes_has_no_hash():
    with pytest.raises(TypeError):
        hash(record())


def test_its_text_tells_what_is_in_it():
    assert repr(ScanRecord(7, 1)) == (
        "ScanRecord(commits=[], duration_ns=0, errors=[], latched=(), reads=[], "
        "scan=1, skipped=0, time_ns=7, writes=[])"
    )


@pytest.mark.parametrize(
    ("name", "entry", "told"),
    [
        ("commits", (6, False), ("has_commits",)),
        ("errors", (40, 7026), ("has_errors",)),
        ("reads", (4, 0, 2.5), ("has_accesses",)),
        ("writes", (5, 1, "text"), ("has_accesses",)),
    ],
)
def test_it_tells_what_it_holds_without_making_a_list(name, entry, told):
    made = ScanRecord(7, 1)
    asked = ("has_commits", "has_errors", "has_accesses")
    assert [getattr(made, word) for word in asked] == [False] * 3
    assert getattr(made, name) == []
    assert [getattr(made, word) for word in asked] == [False] * 3, "an empty list is nothing"
    getattr(made, name).append(entry)
    assert {word for word in asked if getattr(made, word)} == set(told)
    assert getattr(made, name) == [entry]
    assert made != ScanRecord(7, 1)
