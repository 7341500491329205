"""Two racks in two processes on one network: linked, one killed, started again (config/two_racks)."""

import signal

from system.support import ROOT, Automax, Client

FOLDER = ROOT / "config" / "two_racks"
LINE, WINDER = FOLDER / "line" / "rack.yaml", FOLDER / "winder" / "rack.yaml"


def test_a_killed_rack_is_lost_and_heard_again(ros_domain_id):
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from std_msgs.msg import Bool, Int16

    with Client() as client, Automax("run", LINE) as line:
        there = client.listen(Bool, "/line1/common/WIND_THERE", latched=True, depth=100)
        reference = client.listen(Int16, "/line1/common/LINE_REF", latched=True, depth=5000)
        health: list[DiagnosticStatus] = []
        client.node.create_subscription(
            DiagnosticArray,
            "/diagnostics",
            lambda message: health.extend(item for item in message.status if "network_5" in item.name),
            100,
        )
        client.until(lambda: any(item.level == DiagnosticStatus.WARN for item in health), "the winder is not there")
        with Automax("run", WINDER) as winder:
            client.until(lambda: bool(there) and there[-1].data, "the winder is heard")
            client.until(lambda: reference[-1].data > 50, "the line ramps up")
            winder.end(signal.SIGKILL)
            client.until(lambda: not there[-1].data, "the winder is lost")
        top = max(message.data for message in reference)
        client.until(lambda: reference[-1].data < top, "the line ramps down")
        lost = [item for item in health if "code C" in item.message]
        assert lost
        assert "drops 3" in lost[-1].message
        with Automax("run", WINDER) as winder:
            client.until(lambda: there[-1].data, "it is heard again")
            assert winder.end(signal.SIGINT).code == 0
        ended = line.end(signal.SIGINT)
        assert (ended.code, ended.err) == (0, "")
