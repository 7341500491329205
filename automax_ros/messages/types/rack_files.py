"""The files that a rack runs from, its YAML file and the sources of its tasks, as one text for the topic ``config``.

The text is JSON, which is YAML too: ``{"rack": "PM1", "files": [{"name": "rack.yaml", "sha256": "...", "text": "..."},
...]}``. A recorder of a running rack stores these files in the bag, as the rack's own recorder does.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # reading a recording needs no rack, which takes a second to load
    from automax_ros.rack.rack import Rack

RACK_FILE = "rack.yaml"
MAX_TEXT = 16 << 20
"""Longest text of the topic ``config`` that is read (decision: a bound on memory for untrusted senders)."""
_MAX_FILES = 200
_NAME = re.compile(r"rack\.yaml|[A-Z][A-Z0-9_]{0,63}\.(?:BLK|BAS)")


class RackFilesError(ValueError):
    """The text of the topic ``config`` is not one that a rack sends."""


@dataclass(frozen=True)
class RackFile:
    """One file of a rack as a recording stores it: ``rack.yaml``, or a task's name with ``.BLK`` or ``.BAS``."""

    name: str
    text: str

    @property
    def sha256(self) -> str:
        """The hash of the text; for a task's source that of TaskState.source_hash."""
        return hashlib.sha256(self.text.encode("utf-8", "surrogatepass")).hexdigest()

    @property
    def owner(self) -> str:
        """The task whose source it is; the rack file's own name."""
        return self.name if self.name == RACK_FILE else PurePath(self.name).stem

    @property
    def media_type(self) -> str:
        """The media type of the file."""
        return "application/yaml" if self.name == RACK_FILE else "text/plain"

    @property
    def data(self) -> bytes:
        """The file's bytes in a recording."""
        return self.text.encode("utf-8", "replace")


def files_of(rack: Rack) -> list[RackFile]:
    """Return the files that a rack runs from: also the sources of tasks that are in other processes."""
    texts = rack.sources
    texts |= {name: source for name, source in rack.operations.installation.sources.items() if name not in texts}
    sources = [RackFile(source_name(name, source.name), source.text) for name, source in texts.items()]
    return [RackFile(RACK_FILE, rack.config.text), *sources]


def source_name(task: str, file: str) -> str:
    """Return the name under which a task's source is stored: its suffix is that of a BASIC or a control-block task."""
    return f"{task}.BAS" if file.upper().endswith(".BAS") else f"{task}.BLK"


def files_text(rack_name: str, files: Sequence[RackFile]) -> str:
    """Return the text of the topic ``config``; it is ASCII."""
    entries = [{"name": item.name, "sha256": item.sha256, "text": item.text} for item in files]
    return json.dumps({"rack": rack_name, "files": entries})


def files_from_text(text: str) -> list[RackFile]:
    """Return the files in a text of the topic ``config``.

    Raises:
        RackFilesError: too long, not of that form, or a file does not have the hash given with it.
    """
    if len(text) > MAX_TEXT:
        raise RackFilesError(f"{len(text)} characters, at most {MAX_TEXT} are read")
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RackFilesError(f"not JSON: {str(error)[:80]}") from error
    entries = data.get("files") if isinstance(data, dict) else None
    if not isinstance(entries, list) or len(entries) > _MAX_FILES:
        raise RackFilesError("no list of files in it")
    files = [_file(entry) for entry in entries]
    if len({item.name for item in files}) < len(files):
        raise RackFilesError("two files of one name")
    return files


def fingerprint(files: Sequence[RackFile]) -> int:
    """Return ``Rack.fingerprint`` of the rack that runs from these files."""
    texts: Mapping[str, str] = {item.name: item.text for item in files}
    digest = hashlib.sha256(texts.get(RACK_FILE, "").encode("utf-8", "surrogatepass"))
    for name in sorted(texts.keys() - {RACK_FILE}):
        digest.update(PurePath(name).stem.encode() + b"\0" + texts[name].encode("utf-8", "surrogatepass") + b"\0")
    return int.from_bytes(digest.digest()[:8], "big") >> 1


def _file(entry: Any) -> RackFile:
    if not isinstance(entry, dict) or not all(isinstance(entry.get(key), str) for key in ("name", "sha256", "text")):
        raise RackFilesError("a file without name, sha256 or text")
    if not _NAME.fullmatch(entry["name"]):
        raise RackFilesError(f"a file named {entry['name'][:80]!r}")
    file = RackFile(entry["name"], entry["text"])
    if file.sha256 != entry["sha256"]:
        raise RackFilesError(f"{file.name} does not have the hash given with it")
    return file
