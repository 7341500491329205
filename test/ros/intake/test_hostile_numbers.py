"""Numbers and texts that nobody means, on all ways into a rack: each is refused, and the rack goes on."""

import math

from system.support import RACKS

from ros.intake.test_service_requests import parameter
from ros.support import until

MOST = (1 << 63) - 1
CONFIG = RACKS / "operated" / "rack.yaml"
NUMBERS = (math.nan, math.inf, -math.inf, 1e308, -1e308, -1.0, 5e-324)
LONG = "A" * 900_000


def goes_on(live, client) -> None:
    before = live.rack.statistics["SPEED"].scans
    until(live, client, lambda: live.rack.statistics["SPEED"].scans > before + 2)
    assert not live.health.counts["failed callback"], live.health.news()


def test_an_operator_of_numbers_that_nobody_means(live, client, ask):
    from automax_msgs.srv import OperateControl, OperateTask, Power, ReadErrors, ReadValues, Reload, SetValue, Step
    from std_srvs.srv import Trigger

    for number in NUMBERS:
        assert not ask("power", Power, what="cycle", off_for_s=number).ok or number == 5e-324
        if number == 5e-324:
            until(live, client, lambda: live.rack.operations.powered)
    assert ask("run_all", Trigger).success
    held = live.rack.value("REF%")
    assert ask("pause", Trigger).success
    for number in (*NUMBERS[:-1], 2.0**63, 2.0**64):
        assert not ask("step", Step, what="until", until_s=number).ok
    assert not ask("step", Step, what="tick", count=(1 << 32) - 1).ok
    assert ask("step", Step, what="scan", count=(1 << 32) - 1).why == "the time is over"
    assert ask("resume", Trigger).success
    for value in (
        "nan",
        "inf",
        "-inf",
        "1e999",
        str(MOST),
        str(-MOST - 1),
        "9" * 990,
        "0x",
        "\x01",
        "-",
        "1e-999",
        LONG,
    ):
        for service, name in (("set", "REF%"), ("force", "REF%"), ("force", "LINE.N%"), ("tune", "SPEED.TRIM%")):
            assert not ask(service, SetValue, name=name, value=value).ok, (service, value[:20])
        for service, name, control in (("module", "0", "x"), ("plant", "P", "load_torque_nm")):
            assert not ask(service, OperateControl, name=name, control=control, value=value).ok
    for name in ("REF%(9223372036854775807)", "REF%(-1)", "REF%(1e308)", "." * 99, "LINE." * 15, "\x01", LONG):
        assert not ask("set", SetValue, name=name, value="1").ok
        assert not ask("get", ReadValues, names=[name]).ok
        assert not ask("run", OperateTask, task=name).ok
        assert not ask("errors", ReadErrors, task=name).ok
        assert not ask("reload", Reload, task=name, source="10 END").ok
    assert not ask("get", ReadValues, names=["REF%"] * 1001).ok
    assert (live.rack.value("REF%"), live.rack.forces()) == (held, [])
    goes_on(live, client)


def test_parameters_of_numbers_that_nobody_means(live, client, ask):
    from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters

    values = [parameter("SPEED.TRIM%", 2, integer_value=number) for number in (MOST, -MOST - 1, -1)]
    values += [parameter("SPEED.TRIM%", 3, double_value=number) for number in NUMBERS]
    values += [parameter("SPEED.TRIM%", 7, integer_array_value=[MOST] * 5000)]
    values += [parameter("SPEED.TRIM%", 4, string_value=LONG), parameter(LONG, 2, integer_value=1), parameter("", 0)]
    for value in values:
        found = ask("processor_1/set_parameters", SetParameters, parameters=[value])
        assert not any(result.successful for result in found.results), value
    ask("processor_1/list_parameters", ListParameters, prefixes=["", "." * 1000, LONG], depth=(1 << 64) - 1)
    ask("processor_1/get_parameters", GetParameters, names=["", LONG, "\x01"])
    ask("processor_1/describe_parameters", DescribeParameters, names=["", LONG])
    assert live.rack.task("SPEED").value("TRIM%") == 1
    goes_on(live, client)


def test_transitions_that_nobody_means(live, client, ask):
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    for node in ("rack", "processor_1"):
        for wanted in ({"id": 255}, {"id": 0}, {"label": LONG}, {"label": "\x01"}, {"label": "transition_success"}):
            assert not ask(f"{node}/change_state", ChangeState, transition=Transition(**wanted)).success
    goes_on(live, client)
