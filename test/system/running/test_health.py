"""What goes wrong in a rack that lives is seen where it runs: a line when it first happens, then counts."""

import re

from system.support import TYPES, Automax, Client

READY = "Ctrl-C ends the run"


def test_trouble_is_told_once_and_counted(ros_domain_id):
    from automax_msgs.msg import Scan
    from std_msgs.msg import Float32, Int16MultiArray

    with Automax("run", TYPES, "--watch", "REF%") as process, Client() as client:
        process.wait_for_line(READY)
        client.send(Float32, "/types/common/GAIN_REF/set", *[Float32(data=float("nan"))] * 3)
        process.wait_for_line("write refused: ")
        client.send(Int16MultiArray, "/types/common/GRID/set", Int16MultiArray(data=[0] * 6))
        process.wait_for_line("line 240: AMX7")
        client.listen(Scan, "/types/scans", latched=True)
        process.wait_for_line("a reader of /types/scans gets nothing: its quality of service does not fit (durability)")
        process.wait_for_line("REF%=1000")
        client.until(lambda: "QoS conflict" in process.out[-1])
        ended = process.end(2)
    assert (ended.code, ended.err) == (0, "")
    before_the_end = ended.out[: ended.out.index("ran ")]
    told = [line for line in before_the_end.splitlines() if "AMX7" in line or "refused: " in line]
    assert len(told) == 3
    assert re.search(r"3 refused writes  \d+ run-time errors  [1-9] QoS conflicts?  REF%=1000\n", before_the_end)
