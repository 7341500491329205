"""The node of a UDC over real DDS: its scans on the wall clock, its tunables, its entry in /diagnostics."""

from ros.support import until

RACK = """\
rack: WIND
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
  10: {module: 57552, tasks: {WIND_A: {drive: A}, WIND_B: {drive: B}}}
common:
  CCLK@: {slot: 10, register: 2000, bit: 6, ros: in}
  REF%: {slot: 10, register: 302, ros: in}
  OUT%: {slot: 10, register: 304}
  TWICE%: {slot: 10, register: 306}
"""
SOURCES = {
    "LINE": "10 CALL SCAN_LOOP(TICKS=20)\n20 END\n",
    "WIND_A": """\
10 COMMON REF%, OUT%
20 LOCAL GAIN% [CURRENT=3, LOW=1, HIGH=9, STEP=1]
100 CALL SCAN_LOOP(TICKS=20)
110 OUT% = REF% * GAIN%
900 END
""",
    "WIND_B": """\
10 COMMON OUT%, TWICE%
100 CALL SCAN_LOOP(TICKS=20)
110 TWICE% = 2 * OUT%
900 END
""",
}


def test_a_udc_on_the_wall_clock(live, client):
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from std_msgs.msg import Bool, Int16

    health: dict[str, DiagnosticStatus] = {}

    def note(message: DiagnosticArray) -> None:
        health.update({status.name: status for status in message.status})

    node = client.node
    node.create_subscription(DiagnosticArray, "/diagnostics", note, 10)
    clock = node.create_publisher(Bool, "/wind/common/CCLK/set", 10)
    reference = node.create_publisher(Int16, "/wind/common/REF/set", 10)
    rack, name = live.rack, "wind/udc_10: 57552"
    until(live, client, lambda: name in health)
    assert health[name].level == DiagnosticStatus.WARN
    assert rack.task("WIND_A").scan_number == 0

    def sent(publisher, message, common) -> bool:
        publisher.publish(message)
        return rack.value(common) == message.data

    until(live, client, lambda: sent(clock, Bool(data=True), "CCLK@"))
    until(live, client, lambda: sent(reference, Int16(data=100), "REF%"))
    until(live, client, lambda: rack.value("TWICE%") == 600)
    rack.tune(rack.task("WIND_A"), "GAIN%", 4)
    until(live, client, lambda: rack.value("TWICE%") == 800)
    until(live, client, lambda: health[name].level == DiagnosticStatus.OK)
    values = {item.key: item.value for item in health[name].values}
    assert int(values.pop("skipped")) <= sum(item.skipped for item in rack.statistics.values())
    assert values.pop("errors") == "0"
    assert values == {
        "tick_ms": "0.5",
        "tasks": "2",
        "running": "2",
        "iscr": "64",
        "scans_per_interrupt": "0",
        "scans_since_interrupt": "0",
    }
    node_names = {found for found, _ in node.get_node_names_and_namespaces()}
    assert "udc_10" in node_names
    assert abs(rack.task("WIND_A").scan_number - rack.task("WIND_B").scan_number) <= 1
