"""`automax` as a fixture: in this process, in a folder of its own."""

from pathlib import Path

import pytest

from cli.support import Automax


@pytest.fixture
def automax(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Automax:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.delenv("COLUMNS", raising=False)
    return Automax(tmp_path, capsys)
