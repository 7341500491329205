"""`automax` as a fixture: in this process, in a folder of its own."""

import signal
from pathlib import Path

import pytest

from cli.support import Automax


@pytest.fixture
def automax(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Automax:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.delenv("COLUMNS", raising=False)
    return Automax(tmp_path, capsys)


@pytest.fixture
def no_waiting():
    """End a test that waits for the pipe's other end."""

    def end(_number, _frame):
        raise TimeoutError("waits for a pipe")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(30)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)
