"""A rack in another process as a source of the panel, over real DDS: what is followed, and what its operator does."""

import json
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from typing import Any

import pytest
from system.support import RACKS, ROOT, TYPES, Automax
from waiting import wait_until

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.panel.source import Asked, RequestRefused, Source

OPERATED = RACKS / "operated" / "rack.yaml"
DRIVE = ROOT / "config" / "dc_drive" / "rack.yaml"
STARTED = "ROS 2 namespace"
LONG_NS = 60 * NS_PER_S


def joined(space: str) -> Any:
    from automax_ros.panel.joined_rack import JoinedSource

    return JoinedSource(space, wait_ns=LONG_NS)


@pytest.fixture(scope="module")
def source(module_domain_id) -> Iterator[Source]:
    """The rack OPERATED, joined while it runs."""
    with Automax("run", OPERATED) as process:
        process.wait_for_line(STARTED)
        found = joined("/operated")
        yield found
        found.close()


@pytest.fixture
def followed() -> Iterator[Callable[[Source], Source]]:
    """Closes sources at the end of a test."""
    with ExitStack() as stack:
        yield lambda source: stack.enter_context(closing(source))


def values(source: Source, *names: str) -> tuple[Any, ...]:
    return source.frames([Asked(names)])[0].values


def task(source: Source, name: str) -> Any:
    return next((item for item in source.status(None)["tasks"] if item["name"] == name), None)


def test_values_arrive_of_commons_and_of_tasks(source):
    hello = source.hello()
    assert (hello["rack"], hello["kind"], hello["operate"]) == ("OPERATED", "joined", {"allowed": True, "why": ""})
    assert {"REF%", "OUT%", "COUNT!", "SPEED.TRIM%", "LINE.N%"} <= {item["name"] for item in hello["names"]}
    wait_until(lambda: values(source, "REF%", "OUT%", "SPEED.TRIM%", "NONE%") == (100, 101, 1, None))
    first, second = values(source, "COUNT!")[0], source.frames([Asked(("COUNT!",))])[0].time_ns
    wait_until(lambda: values(source, "COUNT!")[0] > first)
    wait_until(lambda: source.frames([Asked(())])[0].time_ns > second)
    assert source.unknown(["NONE%", "REF%", "speed.trim%"]) == ["NONE%"]


def test_what_the_operator_sets_is_shown_and_listed(source):
    last = max((entry["n"] for entry in source.log(0)), default=0)
    assert source.describe("set", {"name": "REF%", "value": "70"}).startswith("set REF% to 70: it is ")
    answer = source.operate("set", {"name": "ref%", "value": "70"})
    assert (answer["ok"], answer["now"]) == (True, "70")
    wait_until(lambda: values(source, "REF%", "OUT%") == (70, 71))
    wait_until(lambda: any(entry["text"] == "REF% = 70" for entry in source.log(last)))
    entry = next(entry for entry in source.log(last) if entry["text"] == "REF% = 70")
    assert (entry["kind"], entry["what"], entry["ok"], entry["code"]) == ("operation", "set", True, "")
    assert source.operate("tune", {"name": "SPEED.TRIM%", "value": "5"})["ok"]
    wait_until(lambda: values(source, "SPEED.TRIM%", "OUT%") == (5, 75))
    assert source.describe("tune", {"name": "speed.trim%", "value": "1"}) == "tune SPEED.TRIM% to 1: it is 5 now"
    assert source.operate("force", {"name": "REF%", "value": "9"})["ok"]
    wait_until(lambda: source.status(None)["forced"] == [{"name": "REF%", "value": "9"}])
    assert source.operate("unforce", {"names": []})["forced"] == []
    wait_until(lambda: source.status(None)["forced"] == [])
    source.operate("tune", {"name": "SPEED.TRIM%", "value": "1"})
    source.operate("set", {"name": "REF%", "value": "100"})


def test_what_the_rack_refuses_has_its_reason(source):
    with pytest.raises(RequestRefused, match="lies outside 0 to 10"):
        source.describe("tune", {"name": "SPEED.TRIM%", "value": "11"})
    refused = source.operate("stop", {"task": "SPEED"})
    assert (refused["ok"], refused["status"]) == (False, "running")
    assert "is critical" in refused["reason"]
    assert source.operate("resume", {})["ok"] is False


def test_status_errors_and_what_stopped_it(source):
    wait_until(lambda: task(source, "LINE") is not None and task(source, "LINE")["errors"]["entries"])
    line = task(source, "LINE")
    assert (line["status"], line["errors"]["count"]) == ("running", 1)
    assert (line["errors"]["entries"][0]["line"], line["errors"]["entries"][0]["scan"]) == (120, 3)
    status = source.status(None)
    assert (status["powered"], status["stopped"], status["over"]) == (True, None, "")
    assert status["operators"] == ["operator node of /operated"]
    assert status["slots"][1]["display"] == {"code": "", "meaning": "no fault"}
    assert source.operate("stop_all", {})["message"] == "0 of 2 tasks run"
    wait_until(lambda: source.status(None)["stopped"] is not None and task(source, "LINE")["status"] == "stopped")
    assert source.status(None)["stopped"]["reason"] == "STOP ALL by the operator"
    assert source.operate("run_all", {})["ok"]
    wait_until(lambda: source.status(None)["stopped"] is None)
    json.dumps(source.status(None), allow_nan=False)
    with pytest.raises(RequestRefused, match="no past"):
        source.answer("scan", {"task": "LINE", "scan": 3})
    assert source.answer("explain", {"code": "14"})["title"]


def test_a_rack_without_an_operator_is_watched_only(ros_domain_id, followed):
    with Automax("run", TYPES) as process:
        process.wait_for_line(STARTED)
        source = followed(joined("/types"))
        assert source.hello()["operate"]["allowed"] is False
        wait_until(lambda: values(source, "REF%", "TWICE%") == (1000, 2000) and task(source, "FAST") is not None)
        assert (task(source, "FAST")["status"], source.status(None)["powered"]) == ("running", True)
        with pytest.raises(RequestRefused, match="operator: true"):
            source.operate("set", {"name": "REF%", "value": "1"})
        process.end(signal.SIGINT)
        wait_until(lambda: source.is_over)
        assert source.status(None)["over"] == "the rack has gone"


def test_a_rack_that_comes_back_is_followed_again(ros_domain_id, followed):
    with Automax("run", OPERATED, "--set", "REF%=3") as process:
        process.wait_for_line(STARTED)
        source = followed(joined("/operated"))
        wait_until(lambda: values(source, "OUT%") == (4,))
        process.end(signal.SIGINT)
        wait_until(lambda: source.is_over)
    with Automax("run", OPERATED, "--set", "REF%=7") as process:
        process.wait_for_line(STARTED)
        wait_until(lambda: values(source, "OUT%") == (8,) and not source.is_over)
        assert source.operate("set", {"name": "REF%", "value": "9"})["ok"]
        wait_until(lambda: values(source, "OUT%") == (10,))


def test_a_drive_and_its_faults(ros_domain_id, followed):
    with Automax("run", DRIVE) as process:
        process.wait_for_line(STARTED)
        source = followed(joined("/drive1"))
        wait_until(lambda: (values(source, "MOTOR/speed_rpm")[0] or 0) > 50)
        (drive,) = source.status(None)["drives"]
        assert (drive["plant"], drive["slot"], drive["delta_deg"]) == ("MOTOR", 7, None)
        assert drive["contactors"] == [{"name": "M", "on": True}]
        assert source.operate("plant", {"name": "MOTOR", "control": "short_scr", "value": "3"})["ok"]
        wait_until(lambda: list(source.status(None)["drives"][0]["broken"]) == ["short_scr 3"])
        wait_until(lambda: source.status(None)["drives"][0]["faults"])
        assert source.status(None)["drives"][0]["faults"][0].startswith("instantaneous overcurrent (IOC)")
        wait_until(lambda: any(entry["kind"] == "error" and entry["task"] == "CML" for entry in source.log(0)))


def test_a_rack_that_is_not_there(ros_domain_id):
    from automax_ros.panel.joined_rack import JoinedSource

    with pytest.raises(UserError, match="no rack /none is seen") as refused:
        JoinedSource("/none", wait_ns=NS_PER_S // 10)
    assert refused.value.hint
