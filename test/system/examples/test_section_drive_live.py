"""The example rack, live: an operator in another process watches the section start, tunes it and stops it."""

import signal

from automax_ros.recordings.read.reader import BagReader
from system.support import ROOT, Automax, Client

CONFIG = ROOT / "config" / "section_drive" / "rack.yaml"


def test_operator_runs_the_section(ros_domain_id, tmp_path):
    from rclpy.parameter import Parameter
    from rclpy.parameter_client import AsyncParameterClient
    from std_msgs.msg import Bool, Int16

    bag = tmp_path / "bag"
    with Automax("run", CONFIG, "--record", bag) as process, Client() as client:
        process.wait_for_line("Ctrl-C ends the run")
        # Who joins before the start sees what is installed first, then the preset.
        wanted = client.listen(Int16, "/pm1/common/LINE_SPEED_SP", latched=True, depth=1)
        client.until(lambda: bool(wanted) and wanted[-1].data == 1500, "the preset of the set-point")
        speed = client.listen(Int16, "/pm1/common/SPEED_FDBK", latched=True, depth=1)
        running = client.listen(Bool, "/pm1/common/RUN", latched=True, depth=1)
        client.until(lambda: bool(speed and running) and running[-1].data and speed[-1].data > 100, "the roll turns")

        parameters = AsyncParameterClient(client.node, "/pm1/processor_2")
        client.until(parameters.services_are_ready)
        (tuned,) = client.result(parameters.set_parameters([Parameter("SPEED.KP_SPEED", value=20.0)])).results
        assert tuned.successful, tuned.reason

        reference = client.listen(Int16, "/pm1/common/LINE_REF", latched=True)
        client.until(lambda: len(reference) > 5, "the reference moves")
        client.send(Bool, "/pm1/common/STOP_PB/set", Bool(data=True))
        client.until(lambda: len(reference) > 5 and reference[-1].data < max(item.data for item in reference))
        ended = process.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")
    states = [item.message for item in BagReader(bag).messages(topics={"/pm1/states"})]
    gains = [state.value[state.field.index("KP_SPEED")] for state in states if state.task == "SPEED"]
    assert gains[0] != gains[-1] == 20.0
