"""A line with webs in another process: joined, operated, recorded from outside, and the tables of that recording."""

import csv
import signal
from collections.abc import Iterator
from contextlib import closing

import pytest
from messages.stream.webs import SPEED, WIND, YAML

from automax_ros.core.ticks import NS_PER_S
from automax_ros.panel.source import Asked
from automax_ros.replay.engine import replay
from system.support import PATIENCE_S, Automax, automax_here, wait_until

NAMES = ("W1/tension_n", "W1/broken", "UNWIND/diameter_m", "PULL/web_mps")


@pytest.fixture(scope="module")
def running(module_domain_id, tmp_path_factory) -> Iterator[Automax]:
    folder = tmp_path_factory.mktemp("line")
    for name, text in (("rack.yaml", YAML), ("SPEED.BLK", SPEED), ("WIND.BLK", WIND)):
        (folder / name).write_text(text)
    with Automax("run", folder) as process:
        process.wait_for_line("Ctrl-C ends the run")
        yield process


@pytest.mark.soak
def test_a_line_is_joined_operated_and_recorded(running, tmp_path):
    from automax_ros.panel.joined_rack import JoinedSource

    bag = tmp_path / "bag"
    with Automax("record", "LINE1", "--output", bag) as recorder:
        recorder.wait_for_line("recording since")
        with closing(JoinedSource("/line1", wait_ns=round(PATIENCE_S * NS_PER_S))) as source:

            def values():
                return source.frames([Asked(NAMES)])[0].values

            try:
                wait_until(lambda: None not in values() and values()[0] > 0.0)
            except AssertionError:
                pytest.fail(f"after {PATIENCE_S} s the joined rack has {values()}, {source.status(None)}")
            assert values()[1] is False
            assert 0.15 < values()[2] < 1.25
            assert automax_here("ctl", "LINE1", "web", "W1", "break").code == 0
            wait_until(lambda: values()[:2] == (0.0, True))
            refused = automax_here("ctl", "LINE1", "web", "W1", "thread")
            assert refused.code == 1
            assert "slow both down to 0.5 m/s" in refused.out + refused.err
            wait_until(lambda: [web["broken"] for web in source.status(None)["webs"]] == [True, False])
            unwind, press = source.status(None)["drives"]
            assert unwind["roll"]["diameter_m"] == values()[2]
            assert press["roll"]["diameter_m"] == 0.5
        assert recorder.end(signal.SIGINT).code == 0
    assert running.process.poll() is None
    table = tmp_path / "out.csv"
    assert automax_here("export", bag, "--watch", ",".join(NAMES), "--output", table).code == 0
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert list(rows[0]) == ["time_s", *NAMES]
    assert {row["W1/broken"] for row in rows if row["W1/broken"]} == {"0", "1"}
    assert (float(rows[-1]["W1/tension_n"]), rows[-1]["W1/broken"]) == (0.0, "1")
    assert replay(bag).identical
