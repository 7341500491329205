"""Trouble is counted; each thing is told once."""

from automax_ros.runtime.health import FROM_STRANGERS, Health


def test_each_thing_is_told_once_and_counted_always():
    health = Health()
    for _ in range(3):
        health.note("refused write", "A%", lambda: "A% refused")
    health.note("refused write", "B%", lambda: "B% refused", times=2)
    assert health.counts == {"refused write": 5}
    assert health.news() == ["A% refused", "B% refused"]
    assert health.news() == []


def test_what_is_told_is_bounded():
    health = Health()
    for number in range(5000):
        health.note("error", number, lambda: "text")
    assert health.counts["error"] == 5000
    assert len(health.news()) == 1000


def test_one_kind_does_not_silence_another():
    health = Health()
    for number in range(5000):
        health.note("other rack", number, lambda: "text", most=FROM_STRANGERS)
    health.note("run-time error", ("SPEED", 100), lambda: "division by zero")
    assert health.counts["other rack"] == 5000
    assert health.news() == ["text"] * FROM_STRANGERS + ["division by zero"]
