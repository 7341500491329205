"""The server: requests of all kinds, frames of what changed, places in a recording, operating in two steps."""

import json
import math
import socket
import threading
import time
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

import automax_ros
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.panel import session
from automax_ros.panel.commands import OPERATIONS, REQUESTS, Allowance, checked
from automax_ros.panel.recording import RecordingSource
from automax_ros.panel.security import PanelOptions
from automax_ros.panel.server import PORTS, PanelServer
from automax_ros.panel.source import Source
from automax_ros.rack.operator.requests import VERBS
from automax_ros.recordings.mcap.errors import BagError
from panel.support import Browser, SmallSource, host_of, served

ROOT = Path(automax_ros.__file__).parents[1]
FORCE = {"verb": "force", "fields": {"name": "REF%", "value": "200"}}


@pytest.fixture
def source():
    return SmallSource()


@pytest.fixture
def server(source):
    with served(source, operate=True) as running:
        yield running


@pytest.fixture
def browser(server):
    with Browser(server) as opened:
        assert opened.next("hello")["rack"] == "PM1"
        yield opened


def error_of(answer):
    assert set(answer) == {"error"}
    assert set(answer["error"]) == {"message", "hint"}
    return answer["error"]["message"]


def test_the_small_source_is_a_source(source):
    seen: Source = source
    assert not seen.is_over


# Requests


@pytest.mark.parametrize(
    "text",
    ["", "x", "[]", "7", "null", '"watch"', "{", '{"id":1,}', "NaN", "[" * 60_000, '{"a":' * 9_000 + "1" + "}" * 9_000,
     '{"id": ' + "9" * 60_000 + "}", b"\x00\xff", b"{}", '{"do": "\\ud800"'],
)  # fmt: skip
def test_what_is_no_message_is_answered_and_nobody_is_harmed(browser, text, capfd):
    answer = browser.send(text)
    assert (answer["id"], answer["error"]["message"]) == (None, "a message is an object of JSON, as text")
    assert "ok" in browser.ask("watch", names=[])
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ({}, "there is no 'None' here"),
        ({"do": "dance"}, "there is no 'dance' here"),
        ({"do": ["watch"]}, "there is no '['watch']' here"),
        ({"do": "watch"}, "watch: names is missing"),
        ({"do": "watch", "names": None}, "watch: names is missing"),
        ({"do": "watch", "names": "REF%"}, "watch: names is not a list of at most 1000 texts"),
        ({"do": "watch", "names": ["A%"] * 1001}, "watch: names is not a list of at most 1000 texts"),
        ({"do": "watch", "names": [1]}, "watch: names is not a list of at most 1000 texts"),
        ({"do": "watch", "names": ["A" * 1001]}, "watch: names is not a list of at most 1000 texts"),
        ({"do": "watch", "names": [], "more": 1}, "watch has no field 'more'"),
        ({"do": "watch", "names": [], "names?": []}, "watch has no field 'names?'"),
        ({"do": "diagram", "task": 1}, "diagram: task is not a text of at most 1000 characters"),
        ({"do": "diagram", "task": "A", "which?": "own"}, "diagram has no field 'which?'"),
        ({"do": "scan", "task": "A", "scan": True}, "scan: scan is not a whole number"),
        ({"do": "scan", "task": "A", "t": 1.5}, "scan: t is not a whole number"),
        ({"do": "scan", "task": "A", "t": 1 << 70}, "scan: t is not a whole number"),
        ({"do": "history", "names": ["A"] * 33, "from_ns": 0, "to_ns": 1, "points": 1}, "at most 32 texts"),
        ({"do": "play", "rate": -1}, "play: rate is not a number from 0 to 100"),
        ({"do": "play", "rate": math.inf}, "play: rate is not a number from 0 to 100"),
        ({"do": "play", "rate": math.nan}, "play: rate is not a number from 0 to 100"),
        ({"do": "prepare", "verb": "force", "fields": []}, "prepare: fields is not an object"),
        ({"do": "confirm", "ticket": {}}, "confirm: ticket is not a text"),
    ],
)
def test_wrong_requests_are_answered(browser, message, text):
    answer = browser.send(json.dumps({"id": "a", **message}))
    assert answer["id"] == "a"
    assert text in answer["error"]["message"]


@pytest.mark.parametrize("ident", [None, [], {}, {"id": [1] * 100}])
def test_an_id_that_is_none_comes_back_as_null(browser, ident):
    assert browser.send(json.dumps({"id": ident, "do": "watch", "names": []}))["id"] is None


def test_a_refusal_of_the_source_comes_with_its_hint(browser):
    assert browser.ask("diagram", task="X") == {"error": {"message": "no such task", "hint": "there is SPEED"}}


def test_a_fault_of_the_source_is_told_and_written_once(browser, capfd):
    for _ in range(3):
        assert error_of(browser.ask("explain", code="AMX\x1b[2J")) == "the panel fails here: ValueError: AMX\ufffd[2J"
    err = capfd.readouterr().err
    assert err.count("panel: a fault of the program:") == 1
    assert "support.py" in err
    assert "ok" in browser.ask("watch", names=[])


def test_a_fault_in_reading_is_shown_until_it_has_gone(source, server, browser, capfd):
    browser.ask("watch", names=["REF%"])
    source.bug = KeyError("REF%")
    while "fails" not in (over := browser.next("status").get("over", "")):
        pass
    assert over == "the panel fails here: KeyError: 'REF%'"
    source.bug = None
    while browser.next("status").get("over") != "":
        pass
    assert capfd.readouterr().err.count("KeyError") == 1


# Frames, status and log


def test_the_first_frame_has_all_and_the_next_what_changed(source, browser):
    assert browser.ask("watch", names=["REF%", "NONE%", "RUN@"]) == {"ok": {"gen": 1, "unknown": ["NONE%"]}}
    assert browser.next("frame") == {"gen": 1, "t": 0, "v": [[0, 0], [1, None], [2, False]]}
    source.values["RUN@"] = True
    assert browser.next("frame") == {"gen": 1, "t": 0, "v": [[2, True]]}
    source.time_ns = 5
    assert browser.next("frame") == {"gen": 1, "t": 5, "v": []}


def test_another_list_begins_again(source, browser):
    browser.ask("watch", names=["REF%"])
    browser.next("frame")
    assert browser.ask("watch", names=["SPEED", "REF%"])["ok"]["gen"] == 2
    assert browser.next("frame") == {"gen": 2, "t": 0, "v": [[0, 1.5], [1, 0]]}
    assert browser.ask("watch", names=[])["ok"]["gen"] == 3
    assert browser.next("frame") == {"gen": 3, "t": 0, "v": []}


def test_numbers_that_json_lacks_are_texts(source, browser):
    source.values = {"A": math.inf, "B": -math.inf, "C": math.nan}
    browser.ask("watch", names=["A", "B", "C"])
    assert browser.next("frame")["v"] == [[0, "inf"], [1, "-inf"], [2, "nan"]]
    source.values["A"] = 1.0
    assert browser.next("frame")["v"] == [[0, 1.0]], "NaN counts as equal to itself"


def test_numbers_that_json_lacks_are_texts_wherever_they_stand(source, browser):
    source.answer = lambda *_: {"v": [math.nan, {"x": (math.inf, 1.0)}]}
    assert browser.ask("explain", code="x") == {"ok": {"v": ["nan", {"x": ["inf", 1.0]}]}}
    source.status = lambda *_: {"tasks": [{"mean_us": math.nan}]}
    assert browser.next("status") in ({"tasks": [{"mean_us": "nan"}]}, {"over": "", "powered": True, "time_ns": 0})


def test_what_cannot_be_sent_is_a_fault_of_the_source(source, browser, capfd):
    source.status = lambda *_: {"tasks": object()}
    while "over" not in (told := browser.next("status")) or not told["over"]:
        pass
    assert told["over"].startswith("the panel fails here: TypeError: ")
    source.status = lambda *_: {"tasks": [], "over": ""}
    assert browser.next("status")["over"] == ""
    assert "a fault of the program" in capfd.readouterr().err


def test_an_answer_that_cannot_be_sent_ends_the_connection_and_is_written(source, server, browser, capfd):
    source.answer = lambda *_: {"x": object()}
    with pytest.raises(ConnectionClosed):
        browser.ask("explain", code="x")
    assert "a fault of the program" in capfd.readouterr().err
    with Browser(server) as other:
        assert "ok" in other.ask("watch", names=[])


def test_an_error_of_the_user_that_the_source_raises_is_an_answer(source, browser):
    def answer(*_):
        raise BagError("AMX6812", "out", "it ends in the middle", "repair it")

    source.answer = answer
    assert browser.ask("explain", code="x")["error"] == {"message": "it ends in the middle", "hint": "repair it"}


def test_no_more_than_20_frames_and_5_looks_at_the_status_per_second(source, browser):
    browser.ask("watch", names=["REF%"])
    counts = {"frame": 0, "status": 0}
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        source.time_ns += 1
        for key in json.loads(browser.socket.recv(timeout=20)):
            counts[key] = counts.get(key, 0) + 1
    assert 4 < counts["frame"] <= 41
    assert 1 < counts["status"] <= 11


def test_only_keys_of_the_status_that_changed_are_sent(source, browser):
    assert browser.next("status") == {"over": "", "powered": True, "time_ns": 0}
    source.time_ns = 7
    assert browser.next("status") == {"time_ns": 7}


def test_the_log_comes_once_to_each_browser_and_in_pieces(source, server, browser):
    source.entries = [{"n": number, "text": "<b>"} for number in range(1, 701)]
    found = browser.next("log")
    assert [entry["n"] for entry in found] == list(range(1, 501))
    assert [entry["n"] for entry in browser.next("log")] == list(range(501, 701))
    source.entries.append({"n": 701, "text": "new"})
    assert browser.next("log") == [{"n": 701, "text": "new"}]
    with Browser(server) as later:
        assert later.next("log")[0]["n"] == 1


def test_one_read_serves_all_browsers(source, server):
    with Browser(server) as first, Browser(server) as second:
        for opened in (first, second):
            opened.ask("watch", names=["REF%"])
            opened.next("frame")
        counted = []
        frames = source.frames
        source.frames = lambda asked: counted.append(len(asked)) or frames(asked)
        time.sleep(0.5)
        assert 2 <= len(counted) <= 12
        assert set(counted) == {2}


def test_the_source_is_called_by_one_thread(source, server):
    threads = set()
    for name in ("frames", "status", "log", "unknown", "describe"):
        act = getattr(source, name)
        setattr(source, name, lambda *given, act=act: threads.add(threading.get_ident()) or act(*given))
    with Browser(server) as first, Browser(server) as second:
        for opened in (first, second):
            opened.ask("watch", names=["REF%"])
            opened.ask("prepare", **FORCE)
            opened.next("frame")
    assert len(threads) == 1


def test_a_flood_of_requests_is_answered_slowly_and_the_others_are_not_held_up(source, server, browser):
    with Browser(server) as other:
        for number in range(400):
            browser.socket.send(json.dumps({"id": number, "do": "watch", "names": []}))
        began = time.monotonic()
        assert "ok" in other.ask("watch", names=[])
        assert time.monotonic() - began < 2.0
    for number in range(400):
        assert browser.next("id")["id"] == number
    assert time.monotonic() - began > 3.0


# Recordings


@pytest.fixture
def recording():
    with served(SmallSource(span=(100, 2_000_000_100)), operate=True) as running, Browser(running) as opened:
        yield opened


def test_a_recording_opens_at_its_end_and_is_sought(recording):
    recording.ask("watch", names=["REF%"])
    assert recording.next("at") == {"t": 2_000_000_100, "rate": 0.0, "following": False}
    assert recording.ask("seek", t=500)["ok"] == {}
    while recording.next("frame")["t"] != 500:
        pass
    for wrong, right in ((-5, 100), (1 << 60, 2_000_000_100)):
        recording.shown.clear()
        recording.ask("seek", t=wrong)
        assert {"at": {"t": right, "rate": 0.0, "following": False}} in recording.shown


def test_a_place_is_a_time_or_a_scan(recording):
    for fields in ({}, {"task": "SPEED"}, {"scan": 3}):
        assert "a time t, or a task and" in error_of(recording.ask("seek", **fields))


def test_a_recording_that_stands_is_not_read_again(recording):
    recording.ask("watch", names=["REF%"])
    recording.next("frame")
    with pytest.raises(TimeoutError):
        recording.next("frame", timeout=0.6)


def test_a_recording_plays_at_its_rate_to_its_end(recording):
    recording.ask("watch", names=["REF%"])
    began = time.monotonic()
    recording.ask("play", rate=2)  # from the end: it begins again
    times = [recording.next("at")]
    while times[-1]["rate"]:
        times.append(recording.next("at"))
    assert 0.9 < time.monotonic() - began < 3.0
    assert times[-1] == {"t": 2_000_000_100, "rate": 0.0, "following": False}
    steps = [item["t"] for item in times]
    assert steps == sorted(steps)
    assert len(steps) > 5


def test_each_browser_has_its_own_place():
    with served(SmallSource(span=(0, 1000))) as running, Browser(running) as first, Browser(running) as second:
        first.ask("seek", t=10)
        second.ask("seek", t=20)
        for opened, at_ns in ((first, 10), (second, 20)):
            opened.ask("watch", names=["REF%"])
            assert opened.next("frame")["t"] == at_ns


def test_a_rack_that_runs_has_no_place(browser):
    for what, fields in (("seek", {"t": 1}), ("play", {"rate": 1.0})):
        assert error_of(browser.ask(what, **fields)) == "a rack that runs is shown as it is now"


def test_a_real_recording_is_served():
    source = RecordingSource(ROOT / "bags" / "section_drive")
    with served(source, operate=True) as running, Browser(running) as opened:
        hello = opened.next("hello")
        assert (hello["rack"], hello["kind"]) == ("PM1", "recording")
        assert opened.ask("watch", names=hello["watch"])["ok"]["unknown"] == []
        assert opened.ask("seek", task="SPEED", scan=100)["ok"] == {}
        *_, place = (message["at"] for message in opened.shown if "at" in message)
        while opened.next("frame")["t"] != place["t"]:
            pass
        assert opened.ask("diagram", task="SPEED")["ok"]["drawable"]
        assert opened.ask("scan", task="SPEED", scan=100)["ok"]["after"]
        assert "the recording holds no scan" in error_of(opened.ask("scan", task="SPEED", scan=1_000_000))
        found = opened.ask("history", names=hello["watch"], from_ns=-5, to_ns=1 << 62, points=10)["ok"]
        assert [len(times) for times in found["t"]] == [len(values) for values in found["v"]]
        assert "nothing may be operated here" in error_of(opened.ask("prepare", **FORCE))


# Operating


def test_an_operation_takes_two_steps(source, browser):
    prepared = browser.ask("prepare", **FORCE)["ok"]
    assert prepared["text"] == "force {'name': 'REF%', 'value': '200'}"
    assert prepared["seconds"] == 30
    assert source.operated == []
    assert browser.ask("confirm", ticket=prepared["ticket"]) == {"ok": {"ok": True, "reason": ""}}
    assert source.operated == [("force", FORCE["fields"])]


def test_a_ticket_holds_once(source, browser):
    ticket = browser.ask("prepare", **FORCE)["ok"]["ticket"]
    browser.ask("confirm", ticket=ticket)
    assert "or was confirmed already" in error_of(browser.ask("confirm", ticket=ticket))
    assert len(source.operated) == 1


def test_a_ticket_holds_in_its_own_connection(source, server, browser):
    ticket = browser.ask("prepare", **FORCE)["ok"]["ticket"]
    with Browser(server) as other:
        assert "was not prepared here" in error_of(other.ask("confirm", ticket=ticket))
    assert source.operated == []


def test_nothing_is_remembered_over_a_reconnection(source, server):
    with Browser(server) as before:
        ticket = before.ask("prepare", **FORCE)["ok"]["ticket"]
    with Browser(server) as after:
        assert "was not prepared here" in error_of(after.ask("confirm", ticket=ticket))
    assert source.operated == []


def test_a_ticket_expires(source, browser, monkeypatch):
    assert session.TICKET_S == 30
    monkeypatch.setattr(session, "TICKET_S", 0.2)
    ticket = browser.ask("prepare", **FORCE)["ok"]["ticket"]
    time.sleep(0.3)
    assert "nothing was done" in error_of(browser.ask("confirm", ticket=ticket))
    assert source.operated == []


def test_a_flood_of_operations_is_refused(source, browser):
    answers = [browser.ask("prepare", **FORCE) for _ in range(15)]
    assert "too many operations at once" in error_of(next(item for item in answers if "error" in item))


@pytest.mark.parametrize(
    ("operator", "operate", "why"),
    [
        (False, True, "its rack file does not say operator: true"),
        (True, False, "start the panel with --operate"),
        (False, False, "its rack file does not say operator: true"),
    ],
)
def test_without_leave_nothing_is_prepared_and_it_says_what_is_missing(operator, operate, why):
    source = SmallSource(operator=operator)
    with served(source, operate=operate) as running, Browser(running) as opened:
        assert opened.next("hello")["operate"] == {"allowed": False, "why": why}
        assert error_of(opened.ask("prepare", **FORCE)) == f"nothing may be operated here: {why}"
        assert error_of(opened.ask("confirm", ticket="x")) == f"nothing may be operated here: {why}"
    assert source.operated == []


def test_a_rack_that_has_ended_is_not_operated(source, browser):
    ticket = browser.ask("prepare", **FORCE)["ok"]["ticket"]
    source.is_over = True
    for answer in (browser.ask("confirm", ticket=ticket), browser.ask("prepare", **FORCE)):
        assert error_of(answer) == "the rack does not run any more, nothing was done"
    assert source.operated == []


@pytest.mark.parametrize(
    ("verb", "fields", "text"),
    [
        ("reload", {"task": "A", "source": ""}, "there is no 'reload' here"),
        ("get", {"names": ["A"]}, "there is no 'get' here"),
        ("status", {}, "there is no 'status' here"),
        ("__class__", {}, "there is no '__class__' here"),
        ("force", {"name": "A"}, "force: value is missing"),
        ("force", {"name": "A", "value": 1}, "force: value is not a text"),
        ("force", {"name": "A", "value": "1", "self": "x"}, "force has no field 'self'"),
        ("run_all", {"task": "A"}, "run_all has no field 'task'"),
        ("unforce", {"names": "A"}, "unforce: names is not a list"),
        ("power", {"what": "off", "off_for_s": "1"}, "power: off_for_s is not a number"),
        ("power", {"what": "off", "without_battery": 1}, "power: without_battery is not true or false"),
        ("step", {"what": "scan", "count": 1.0}, "step: count is not a whole number"),
    ],
)
def test_wrong_operations_are_refused_before_the_rack_is_asked(source, browser, verb, fields, text):
    assert text in error_of(browser.ask("prepare", verb=verb, fields=fields))


def test_every_operation_of_the_rack_has_fields_of_known_kinds():
    samples = {"str": "x", "bool": True, "int": 1, "float": 1.0, "Sequence[str]": ["x"]}
    for verb in OPERATIONS:
        kinds = {name: kind for name, kind in VERBS[verb].act.__annotations__.items() if name != "return"}
        assert checked(verb, {name: samples[kind] for name, kind in kinds.items()}, OPERATIONS) is not None


def test_an_allowance_grows_again():
    allowance = Allowance(2.0, 3)
    assert [allowance.take(100.0) for _ in range(4)] == [True, True, True, False]
    assert [allowance.take(100.5), allowance.take(100.6)] == [True, False]


# The server itself


def test_every_request_of_the_page_is_documented():
    page = (ROOT / "docs" / "panel.md").read_text(encoding="utf-8")
    assert not [name for name in REQUESTS if f"| `{name}` |" not in page]


def test_a_port_that_is_taken_is_told_and_the_source_is_closed_all_the_same(server):
    source = SmallSource()
    second = PanelServer(source, PanelOptions(port=int(host_of(server).rpartition(":")[2])))
    with pytest.raises(UsageError, match="another program has it"):
        second.start()
    second.close()
    assert source.closed == 1


def test_without_a_port_the_next_free_one_is_taken():
    with served(SmallSource(), port=None) as first, served(SmallSource(), port=None) as second:
        ports = [int(host_of(item).rpartition(":")[2]) for item in (first, second)]
    assert ports[0] != ports[1]
    assert all(port in PORTS or port > 1024 for port in ports)


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid"])
def test_a_host_that_is_none_of_this_machine_is_told(host):
    source = SmallSource()
    server = PanelServer(source, PanelOptions(port=0, host=host))
    with pytest.raises(UsageError, match="cannot have port"):
        server.start()
    server.close()
    assert source.closed == 1


def test_a_source_that_cannot_be_shown_ends_the_start(source):
    def refuse():
        raise UserError("it is empty")

    source.hello = refuse
    server = PanelServer(source, PanelOptions(port=0))
    with pytest.raises(UserError, match="it is empty"):
        server.start()
    server.close()


def test_it_ends_with_its_connections_its_threads_and_its_port():
    source = SmallSource()
    before = threading.active_count()
    with served(source) as server:
        browsers = [Browser(server) for _ in range(3)]
        port = int(host_of(server).rpartition(":")[2])
        began = time.monotonic()
    assert time.monotonic() - began < 5.0
    assert source.closed == 1
    for opened in browsers:
        opened.socket.close()
    end = time.monotonic() + 10
    while threading.active_count() > before and time.monotonic() < end:
        time.sleep(0.05)
    assert threading.active_count() <= before
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", port))
