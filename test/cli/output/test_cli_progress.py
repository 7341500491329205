"""The progress bar: only on a terminal, only after two seconds."""

import io
import sys

import pytest

from automax_ros.cli.output import screen as progress
from automax_ros.cli.output.screen import ProgressBar, share_shown


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def seconds(monkeypatch):
    """Set the clock by hand: `seconds[0]` is the time."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def shown(stream, seconds, monkeypatch, times, **options):
    monkeypatch.setattr(sys, "stderr", stream)
    with ProgressBar("trace", 100, **options) as bar:
        for seconds[0] in times:
            bar.show(50)
    return stream.getvalue()


def test_work_that_lasts_shows_how_much_is_done(seconds, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    text = shown(Terminal(), seconds, monkeypatch, [1.0, 3.0, 4.0])
    assert "trace" in text
    assert "50%" in text


def test_short_work_shows_nothing(seconds, monkeypatch):
    assert shown(Terminal(), seconds, monkeypatch, [0.5, 1.9]) == ""


def test_no_terminal_no_bar(seconds, monkeypatch):
    assert shown(io.StringIO(), seconds, monkeypatch, [3.0]) == ""


def test_bar_can_be_unwanted(seconds, monkeypatch):
    assert shown(Terminal(), seconds, monkeypatch, [3.0], wanted=False) == ""


def test_share_of_the_work(seconds, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with share_shown("export") as progress:
        for seconds[0], share in ((1.0, 0.1), (3.0, 0.25)):
            progress(share)
    assert "export" in stream.getvalue()
    assert "25%" in stream.getvalue()
    assert "10%" not in stream.getvalue()
