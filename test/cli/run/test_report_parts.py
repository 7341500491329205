"""The reports of a rack's processes, put together as if it had been one."""

from __future__ import annotations

from automax_ros.cli.run.process_messages import merged_report


def part(**given):
    empty = {"rack": "PM1", "time_s": 2.0, "stopped": None, "tasks": {}, "commons": {}, "forced": [], "operations": []}
    return {**empty, **given}


def done(at, what, of="", *, ok=True, why=""):
    return {"at": at, "what": what, "of": of, "ok": ok} | ({} if ok else {"why": why})


def test_commons_are_the_homes_and_tasks_their_own():
    home = part(commons={"A%": 1, "B%": 2}, forced=["A%"])
    one = part(time_s=1.9, commons={"A%": 1, "B%": 3}, tasks={"ONE": {"scans": 5}})
    two = part(commons={"A%": 1, "B%": 2}, tasks={"TWO": {"scans": 6}})
    report = merged_report({"two": two, "one": one, "home": home}, ["home", "one", "two"], {"two": 3})
    assert report["commons"] == {"A%": 1, "B%": 2}
    assert (report["time_s"], report["forced"]) == (2.0, ["A%"])
    assert report["tasks"] == {"ONE": {"scans": 5}, "TWO": {"scans": 6}}
    assert report["processes"] == {
        "home": {"deaths": 0, "told": True, "differs": []},
        "one": {"deaths": 0, "told": True, "differs": ["B%"]},
        "two": {"deaths": 3, "told": True, "differs": []},
    }


def test_what_happened_everywhere_happened_once():
    home = part(operations=[done(1.0, "stop_all"), done(3.0, "run", "TWO")])
    one = part(
        operations=[done(1.0, "stop_all"), done(2.0, "run", "ONE", ok=False, why="no"), done(4.0, "force", "A%")]
    )
    two = part(operations=[done(1.0, "stop_all"), done(2.0, "run", "ONE"), done(4.0, "force", "B%")])
    report = merged_report({"home": home, "one": one, "two": two}, ["home", "one", "two"], {})
    assert report["operations"] == [
        done(1.0, "stop_all"),
        done(2.0, "run", "ONE", ok=False, why="no"),
        done(3.0, "run", "TWO"),
        done(4.0, "force", "A%"),
        done(4.0, "force", "B%"),
    ]


def test_the_first_word_of_a_stop_counts():
    later, first = ({"time_s": time_s, "code": "31", "task": None, "reason": "lost"} for time_s in (1.1, 1.0))
    report = merged_report({"home": part(stopped=later), "one": part(stopped=first)}, ["home", "one"], {})
    assert report["stopped"] == first


def test_a_process_that_told_nothing_is_named():
    report = merged_report({"home": part()}, ["home", "one"], {"one": 1})
    assert report["processes"]["one"] == {"deaths": 1, "told": False, "differs": []}


def test_displays_are_those_of_the_processes_that_have_the_processors():
    quiet, overlap = {"code": None, "meaning": "no fault"}, {"code": "14", "meaning": "overlap"}
    parts = {"home": part(displays={"processor_1": quiet}), "two": part(displays={"processor_2": overlap})}
    report = merged_report(parts, ["home", "two"], {})
    assert report["displays"] == {"processor_1": quiet, "processor_2": overlap}
