"""`automax ctl` with a rack that answers as the test says: what is asked, and what is printed."""

from __future__ import annotations

import argparse
import io
import json
import re
from types import SimpleNamespace
from typing import Any

import pytest

from automax_ros.cli.operate.actions import ACTIONS, add_actions
from automax_ros.cli.operate.ctl import RackSession
from automax_ros.cli.operate.prompt import run_shell
from automax_ros.cli.visible import VisibleOutput
from automax_ros.core.user_error import UsageError
from cli.test_visible_output import EVIL, RAW

pytest.importorskip("automax_msgs.srv")

STATUS = {
    "rack": "DRIVE1", "time_s": 200.0, "powered": True, "halted": False, "stopped": False, "stopped_at_s": 0.0,
    "stopped_code": "", "stopped_task": "", "stopped_reason": "", "tasks": 5, "running": 4, "ended": 1, "forced": 0,
    "display_modules": ["processor_1"], "display_codes": ["87"], "display_meanings": ["shorted SCR"],
    "drive_faults": ["CML: tach loss at 188.9 s, not cleared"], "racks": 1, "absent": ["udc_10"],
}  # fmt: skip


class Message(SimpleNamespace):
    """An answer of ROS, as far as it is looked at."""

    def get_fields_and_field_types(self) -> dict[str, str]:
        return dict.fromkeys(vars(self), "")


class Rack:
    """Holds values, and notes what it is asked."""

    def __init__(self, **values: str) -> None:
        self.values, self.asked, self.alone_ns, self.racks = values, [], [], 1
        self.answers: dict[str, Any] = {}
        self.waits_ns: set[int] = set()

    def find(self, _: int, alone_ns: int = 0) -> None:
        self.alone_ns.append(alone_ns)

    def refuse_several(self, racks: int) -> None:
        from automax_ros.ros.clients.rack_client import NotOperable

        if racks > 1:
            raise NotOperable(f"{racks} racks")

    def call(self, _: Any, name: str, request: Any, wait_ns: int) -> Any:
        self.waits_ns.add(wait_ns)
        if name in self.answers:
            return self.answers[name]
        if name == "status":
            return Message(ok=True, reason="", **(STATUS | {"racks": self.racks}))
        if name == "set":
            self.asked.append((request.name, request.value))
            before = self.values.get(request.name)
            if before is None:
                return SimpleNamespace(ok=False, reason=f"no {request.name}", before="", now="")
            self.values[request.name] = {"1": "TRUE", "0": "FALSE"}.get(request.value, request.value)
            return SimpleNamespace(ok=True, reason="", before=before, now=self.values[request.name])
        names = list(request.names)
        values = [self.values[item] for item in names]
        return SimpleNamespace(ok=True, reason="", found=names, values=values, shown=["" for _ in names])


def do(rack: Rack, *words: str) -> int:
    parser = argparse.ArgumentParser()
    add_actions(parser)
    arguments = parser.parse_args(words)
    return RackSession(rack, lambda: False).do(ACTIONS[arguments.action], arguments)


def test_a_value_that_was_there_already_is_told(capsys):
    rack = Rack(**{"START_PB@": "TRUE", "REF%": "5"})
    assert do(rack, "set", "START_PB@=1", "REF%=6") == 0
    assert capsys.readouterr().out == "set START_PB@ = 1: was already 1\nset REF% = 6: done\n"
    do(rack, "set", "REF%=6", "--json")
    (entry,) = json.loads(capsys.readouterr().out)
    assert (entry["already"], entry["now"]) == (True, "6")


def test_a_press_sets_holds_and_lets_go(capsys):
    rack = Rack(**{"A@": "FALSE", "B@": "FALSE"})
    assert do(rack, "press", "A@", "B@", "--for", "0.01") == 0
    assert rack.asked == [("A@", "TRUE"), ("B@", "TRUE"), ("A@", "FALSE"), ("B@", "FALSE")]
    assert capsys.readouterr().out == "press A@: done\npress B@: done\n"


def test_what_is_pressed_already_or_unknown_is_refused_and_the_others_are_let_go(capsys):
    rack = Rack(**{"A@": "FALSE", "B@": "TRUE"})
    assert do(rack, "press", "A@", "B@", "NIL@", "--for", "0.01") == 1
    assert rack.values == {"A@": "FALSE", "B@": "TRUE"}
    done_text = capsys.readouterr()
    assert done_text.out == "press A@: done\n"
    assert "press B@: refused: it was already 1: `set B@=0` lets it go" in done_text.err
    assert "press NIL@: refused: no NIL@" in done_text.err


def test_only_booleans_are_pressed():
    with pytest.raises(UsageError, match="'REF%' cannot be pressed"):
        do(Rack(), "press", "REF%")


def test_status_says_what_tripped_what_ended_and_what_is_displayed(capsys):
    assert do(Rack(), "status") == 0
    assert capsys.readouterr().out.splitlines() == [
        "rack DRIVE1: 200.000 s, 4 run, 1 ended",
        "CML: tach loss at 188.9 s, not cleared",
        "display of processor_1: 87, shorted SCR",
        "did not answer, and is missing above: udc_10",
    ]


@pytest.mark.parametrize(("local", "waits"), [(True, False), (False, True)])
def test_who_operates_asks_the_rack_whether_it_is_alone_where_all_are_on_this_host(monkeypatch, local, waits):
    from automax_ros.ros.clients.recorded_run import ALONE_NS
    from automax_ros.ros.setup import discovery as discovery_range

    monkeypatch.setattr(discovery_range, "is_this_host_alone", lambda: local)
    rack = Rack(**{"A@": "FALSE"})
    do(rack, "set", "A@=1")
    assert rack.alone_ns == [0, ALONE_NS if waits else 0]
    rack.alone_ns.clear()
    rack.racks = 0  # it has just been started, and does not know yet
    do(rack, "set", "A@=1")
    assert rack.alone_ns == [0, ALONE_NS]
    rack.alone_ns.clear()
    do(rack, "get", "A@")
    assert rack.alone_ns == [0], "who only reads does not wait"


def test_a_second_rack_that_the_rack_knows_of_is_operated_by_nobody():
    from automax_ros.ros.clients.rack_client import NotOperable

    rack = Rack(**{"A@": "FALSE"})
    rack.racks = 2
    with pytest.raises(NotOperable):
        do(rack, "set", "A@=1")
    assert rack.asked == []


def hostile(action: str) -> tuple[Rack, list[str]]:
    """A rack whose every text is hostile, and the words of a question."""
    rack = Rack()
    text = f"{EVIL}\nrack PM1: all is well"
    refusal = SimpleNamespace(ok=False, reason=text, success=False, message=text, findings=[EVIL])
    entry = {"task": text, "place": text, "line": 1, "code": text, "text": text, "scan": 1}
    task = {"task": text, "module": text, "status": text, "priority": 1, "period_ms": 1.0, "scans": 1, "skipped": 0}
    status = {key: text if isinstance(value, str) else value for key, value in STATUS.items()}
    lists = {key: [text] for key, value in STATUS.items() if isinstance(value, list)}
    values = SimpleNamespace(ok=True, found=[text], values=[text], shown=[text])
    rack.answers = {
        "status": Message(ok=True, **(status | lists | {"stopped": True})),
        "get": values,
        "forces": values,
        "errors": SimpleNamespace(ok=True, errors=[Message(**entry)]),
        "tasks": SimpleNamespace(ok=True, tasks=[Message(**task, errors=1)]),
        "run_all": SimpleNamespace(success=True, message=text),
        "stop": refusal,
        "reload": refusal,
    }
    more = {"get": ["A%"], "watch": ["A%", "--duration", "0.1"], "stop": [EVIL]}
    return rack, [action, *more.get(action, [])]


@pytest.mark.parametrize("action", ["status", "get", "watch", "forces", "errors", "tasks", "run-all", "stop"])
def test_no_control_character_of_an_answer_is_printed(action, capsys):
    rack, words = hostile(action)
    output = VisibleOutput()  # as main does
    try:
        do(rack, *words)
    finally:
        output.undo()
    done_text = capsys.readouterr()
    assert not RAW.findall(done_text.out + done_text.err)
    assert "\N{REPLACEMENT CHARACTER}" in done_text.out + done_text.err
    assert not re.search("^rack PM1", done_text.out + done_text.err, re.MULTILINE), "no line of its own"
    do(rack, *words, "--json")
    assert not RAW.findall(capsys.readouterr().out)


def test_a_prompt_goes_on_after_errors_and_ends_with_its_input(monkeypatch, capsys):
    rack = Rack(**{"REF%": "5", "A@": "FALSE"})

    class Connected:
        def __init__(self, *_: object) -> None: ...

        def __enter__(self) -> RackSession:
            return RackSession(rack, lambda: False)

        def __exit__(self, *_: object) -> None: ...

    lines = "get REF%\nfoo\nset 'REF%\npress REF%\n\n# a remark\nset REF%=7\nset NIL%=1\nquit\nset REF%=8\n"
    monkeypatch.setattr("sys.stdin", io.StringIO(lines))
    code = run_shell(argparse.Namespace(rack="PM1", timeout=30 * 10**9), Connected)
    done_text = capsys.readouterr()
    assert (code, rack.values["REF%"]) == (1, "7")
    assert rack.waits_ns == {30 * 10**9}, "each line waits as long as the prompt"
    assert done_text.out == "REF% = 5\nset REF% = 7: done\n"
    assert "invalid choice: 'foo'" in done_text.err
    assert "No closing quotation" in done_text.err
    assert "cannot be pressed" in done_text.err
    assert "set NIL% = 1: refused: no NIL%" in done_text.err
