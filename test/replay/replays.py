"""Recordings of small racks and their replays, for the tests of replay."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from recordings.live_racks import build

from automax_ros.core.diagnostics import SourceText
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import NAMES
from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.rack.rack import Rack
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.recordings.write.writer import BagWriter
from automax_ros.replay.engine import ReplayOptions, replay
from automax_ros.replay.scans.report import ReplayReport

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      SPEED: {priority: 4}
      WORK: {priority: 8}
common:
  REF%: {preset: 100, unit: counts}
  OUT%: {unit: counts}
  COUNT!: {}
  GAIN: {preset: 1.5}
  TOTAL: {}
  RUN@: {}
  FLAG@: {}
  NOTE$:8: {preset: ready}
  COPY$:8: {}
  TABLE%(1,2): {}
  SPARE%: {}
"""
SPEED = """\
10 COMMON REF%, OUT%, RUN@
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], SUM%, FILTERED%
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=REF%, INPUT2=TRIM%, OUTPUT=SUM%)
120 CALL LAG(INPUT=SUM%, WLG=10.0, RESET=-RUN@, OUTPUT=FILTERED%)
130 CALL MULTIPLY_DIVIDE(INPUT1=FILTERED%, INPUT2=100, INPUT3=100, OUTPUT=OUT%)
140 END
"""
WORK = """\
10 COMMON GAIN, TOTAL, NOTE$:8, COPY$:8, TABLE%(1,2), COUNT!, FLAG@, OUT%
20 LOCAL I%, J%, NIL%
30 COUNT! = 5
100 CALL SCAN_LOOP(TICKS=2)
110 TOTAL = TOTAL * 0.5 + GAIN
120 COPY$ = LEFT$(NOTE$, 4)
130 FOR I% = 0 TO 2
140 J% = TABLE%(0,I%) + I%
150 TABLE%(1,I%) = J%
160 NEXT I%
170 COUNT! = COUNT! + 1
180 FLAG@ = TOTAL > 2.0
190 IF OUT% > 200 THEN J% = J% / NIL%
200 END
"""

Steps = Callable[[Rack, int], None]


def busy(rack: Rack, number: int) -> None:
    """What the plant does between two slices of the run: every value changes."""
    rack.write("REF%", (number * 37) % 500)
    rack.write("GAIN", number / 8)
    rack.write("RUN@", number % 5 != 4)
    rack.write("NOTE$", ["", "ready", "Grüße", "12345678"][number % 4])
    rack.write("TABLE%", number * 10 - 90, element=number % 3)


def record(
    rack: Rack,
    bag: Path,
    steps: Steps | None = None,
    slices: int = 20,
    seconds: float = 2.0,
    options: RecordingOptions | None = None,
) -> Path:
    """Record a run; ``steps`` does something to the rack before each of the slices."""
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, bag, options)
    stream.begin()
    rack.start()
    for number in range(slices):
        if steps is not None:
            steps(rack, number)
        rack.run(seconds / slices)
    stream.end()
    recorder.close()
    assert recorder.failure is None
    return bag


def recorded(
    folder: Path,
    steps: Steps | None = busy,
    seconds: float = 2.0,
    yaml: str = YAML,
    options: RecordingOptions | None = None,
    **tasks: str,
) -> Path:
    """Record the rack of this module, with some of its sources replaced."""
    folder.mkdir(exist_ok=True)
    rack = build(folder, yaml, **{"SPEED": SPEED, "WORK": WORK, **tasks})
    return record(rack, folder / "bag", steps, seconds=seconds, options=options)


def replayed(bag: Path, new: Mapping[str, str] | None = None, **options: Any) -> ReplayReport:
    """Replay with the given sources."""
    sources = {name: SourceText(f"new/{name}.BLK", text) for name, text in (new or {}).items()}
    return replay(bag, sources, ReplayOptions(**options))


def edited(text: str, *changes: tuple[str, str]) -> str:
    """A source with some pieces replaced, each of which must be there once."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def rewritten(
    bag: Path,
    folder: Path,
    change: Callable[[Any], Any] = lambda message: message,
    attachments: Callable[[str, bytes], bytes | None] = lambda _, data: data,
    payload: Callable[[Any, bytes], bytes] = lambda _, data: data,
) -> Path:
    """A copy of a recording in which messages are changed, or left out where ``change`` returns None.

    ``payload`` changes their bytes.
    """
    reader = BagReader(bag)
    with BagWriter(folder, custom_data=reader.custom_data) as writer:
        for item in reader.attachments():
            data = attachments(item.name, item.data)
            if data is not None:
                writer.attach(item.name, item.media_type, data)
        for entry in reader.messages():
            message = change(entry.message)
            if message is not None:
                qos = LATCHED if entry.topic.endswith(("variables", "snapshot")) else SCAN
                channel = writer.channel(entry.topic, NAMES[type(message)], qos)
                writer.write(channel, entry.stamp, payload(message, encode(message)))
    return folder
