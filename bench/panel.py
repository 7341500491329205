"""How late scans are while three browsers watch 300 values at 20 Hz, and while nobody looks. Never fails.

The rack is one on the wall clock in this process, its scans every 5.5 ms; the browsers are one other process. Both take
turns, because a host of varying speed would else decide.
"""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", "88")

from automax_ros.cli.run.live import SWITCH_S
from automax_ros.ros.setup.environment import prepare
from automax_ros.runtime.tasks.task import ScanRecord, Task

BROWSERS, VALUES, TURNS, TURN_S = 3, 300, 6, 5.0
NAMES = [f"V{number}%" for number in range(VALUES)]
WATCH = "--watch"


class Lateness:
    """An observer of the rack that notes how long after its instant each scan has ended, by this host's clock."""

    def __init__(self) -> None:
        self.apart_ns: list[int] = []
        self.written = self.tuned = self.operated = lambda *_: None

    def scanned(self, _task: Task, record: ScanRecord, _writes: object) -> None:
        """Note the end of a scan."""
        self.apart_ns.append(time.monotonic_ns() - record.time_ns)


def rack_file(folder: Path) -> Path:
    """Write a rack whose task changes all values in each scan, and return its file."""
    commons = "".join(f"  {name}: {{}}\n" for name in NAMES)
    slots = "slots:\n  0:\n    module: 57C435\n    tick_ms: 5.5\n    tasks:\n      T: {priority: 4}\n"
    (folder / "rack.yaml").write_text(f"rack: BENCH\n{slots}common:\n{commons}")
    lines = [f"{10 + number} COMMON {name}" for number, name in enumerate(NAMES)]
    lines += ["900 LOCAL N%", "1000 CALL SCAN_LOOP(TICKS=1)", "1010 N% = N% + 1", "1020 IF N% > 30000 THEN N% = 0"]
    lines += [f"{2000 + 10 * number} {name} = N%" for number, name in enumerate(NAMES)]
    (folder / "T.BLK").write_text("\n".join([*lines, "9000 END"]) + "\n")
    return folder / "rack.yaml"


async def watch(address: str) -> None:
    """Open browsers and read what they are sent, until this process is ended."""
    import json
    from urllib.request import HTTPRedirectHandler, build_opener

    from websockets.asyncio.client import connect

    class Stay(HTTPRedirectHandler):
        def redirect_request(self, *_: object) -> None:
            return None

    try:
        build_opener(Stay).open(address)
    except OSError as answer:
        cookie = answer.headers["Set-Cookie"].split(";")[0]  # type: ignore[attr-defined]
    host = address.split("/")[2]

    async def browse() -> None:
        headers = {"Cookie": cookie}
        async with connect(f"ws://{host}/socket", origin=f"http://{host}", additional_headers=headers) as socket:
            await socket.send(json.dumps({"id": 1, "do": "watch", "names": NAMES}))
            async for _ in socket:
                pass

    await asyncio.gather(*(browse() for _ in range(BROWSERS)))


def percentiles(late_us: list[float]) -> str:
    """Return p50, p99 and the greatest, in us."""
    ordered = sorted(late_us)
    places = (ordered[len(ordered) // 2], ordered[int(len(ordered) * 0.99)], ordered[-1])
    return "p50 {:8.1f}  p99 {:8.1f}  max {:8.1f} us".format(*places)


def main() -> None:
    prepare()
    sys.setswitchinterval(SWITCH_S)
    import rclpy

    from automax_ros import Rack, RackNodes, load
    from automax_ros.panel.live_rack import RackSource
    from automax_ros.panel.security import PanelOptions
    from automax_ros.panel.server import PanelServer

    with tempfile.TemporaryDirectory() as scratch:
        config = load(rack_file(Path(scratch))).config
        assert config is not None
        rack = Rack(config, stopwatch=time.monotonic_ns)
        rclpy.init()
        late: dict[bool, list[float]] = {False: [], True: []}
        with RackNodes(rack) as nodes:
            lateness = Lateness()
            rack.observe(lateness)
            source = RackSource(rack, lambda: nodes.lock, title="bench", stream=nodes.stream, measured=True)
            server = PanelServer(source, PanelOptions(port=0))
            server.start()
            nodes.start()
            time.sleep(1)
            for turn in range(TURNS):
                watched = bool(turn % 2)
                command = [sys.executable, __file__, WATCH, server.address]
                browsers = subprocess.Popen(command) if watched else None
                time.sleep(1)
                before = len(lateness.apart_ns)
                time.sleep(TURN_S)
                late[watched] += lateness.apart_ns[before:]
                if browsers is not None:
                    browsers.terminate()
                    browsers.wait()
            server.close()
        rclpy.shutdown()
    least = min(min(times) for times in late.values())
    for watched, words in ((False, "nobody looks"), (True, f"{BROWSERS} browsers, {VALUES} values each")):
        print(f"  {words:32} {percentiles([(apart - least) / 1000 for apart in late[watched]])}")


if __name__ == "__main__":
    if WATCH in sys.argv:
        asyncio.run(watch(sys.argv[-1]))
    else:
        main()
