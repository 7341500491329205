"""Compares texts with golden files; AUTOMAX_UPDATE_GOLDEN=1 writes them again, but never in continuous integration."""

import os
from pathlib import Path

GOLDEN = Path(__file__).parents[0] / "golden"
UPDATE = "AUTOMAX_UPDATE_GOLDEN"


def check_golden(path: Path, text: str) -> None:
    """Fail unless the file at ``path`` holds ``text``, byte for byte in UTF-8."""
    if os.environ.get(UPDATE) == "1":
        if os.environ.get("CI") == "true":
            raise RuntimeError(f"{UPDATE} is set in continuous integration: golden files are written by people")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode())
    assert path.exists(), f"{path} does not exist; {UPDATE}=1 writes it"
    assert path.read_bytes().decode() == text
