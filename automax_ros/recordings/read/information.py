"""What a recording tells of itself: metadata.yaml, the copy of it in a data file, and the data files that it names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

from mcap.records import Metadata

from automax_ros.core.yaml_text import Flaw, YamlFault, read_data
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.metadata import METADATA_FILE
from automax_ros.recordings.mcap.opening import no_recording, opened

MAX_METADATA_BYTES = 4 << 20
"""Longest metadata.yaml that is read, in bytes (decision: a bound on memory for untrusted recordings)."""
_MAX_YAML_NODES = 2_000_000
"""More keys and values than fit in MAX_METADATA_BYTES."""
MAX_FILES = 10_000
_NUMBERED = re.compile(r"(.*?)_?(\d{1,9})\.mcap")


def read_information(folder: Path) -> dict[str, Any]:
    """Return the content of a folder's metadata.yaml, checked as far as it is used; all scalars are strings.

    Raises:
        BagError: it does not exist, cannot be read, or describes no mcap files.
    """
    path = folder / METADATA_FILE
    if not path.exists():
        hint = (
            "the recording was not finished: `automax bag repair` completes it; or this is another folder; "
            "a single .mcap file can be read by its own name"
        )
        raise BagError("AMX6810", folder, "has no metadata.yaml", hint)
    with opened(path) as file:
        text = file.read(MAX_METADATA_BYTES + 1)
    if len(text) > MAX_METADATA_BYTES:
        raise BagError("AMX6814", path, f"is longer than {MAX_METADATA_BYTES} bytes")
    data = load_yaml(path, text)
    information = data.get("rosbag2_bagfile_information") if isinstance(data, dict) else None
    if not isinstance(information, dict):
        raise BagError("AMX6813", path, "does not describe a recording (rosbag2_bagfile_information is missing)")
    compressed = str(information.get("compression_mode", "")).lower() not in {"", "none"}
    if information.get("storage_identifier") != "mcap" or compressed:
        hint = "convert it with `ros2 bag convert` to storage mcap without compression of files or messages"
        raise BagError("AMX6811", path, "is stored in another way than mcap", hint)
    return information


def recorded_information(record: Metadata) -> dict[str, Any] | None:
    """Return a data file's copy of metadata.yaml; None if the record is another one or cannot be read."""
    text = record.metadata.get("serialized_metadata", "") if record.name == "rosbag2" else ""
    if not text or len(text) > MAX_METADATA_BYTES:
        return None
    try:
        information = load_yaml("rosbag2", text.encode("utf-8", "replace"))
    except BagError:
        return None
    return information if isinstance(information, dict) else None


def custom_data_of(information: Mapping[str, Any]) -> dict[str, str]:
    """Return the custom data in the content of metadata.yaml."""
    custom = information.get("custom_data")
    return {str(key): str(value) for key, value in custom.items()} if isinstance(custom, dict) else {}


def load_yaml(path: object, text: bytes) -> Any:
    """Load YAML without aliases and of bounded depth, which keeps the loader's effort and stack in bounds.

    Raises:
        BagError: it is not such YAML; ``path`` is named in the error.
    """
    try:
        return read_data(text.decode(), nodes=_MAX_YAML_NODES)
    except YamlFault as fault:
        code = "AMX6813" if fault.flaw is Flaw.SYNTAX else "AMX6814"
        raise BagError(code, path, f"is not readable YAML: {fault.message}", fault.hint) from fault
    except UnicodeDecodeError as error:
        raise BagError("AMX6813", path, f"is not readable YAML: {error.reason}") from error


def file_place(path: Path) -> tuple[str, int, str]:
    """Return the sort key of a data file: files of one name are sorted by number."""
    match = _NUMBERED.fullmatch(path.name)
    return (match[1], int(match[2]), path.name) if match else (path.name, -1, path.name)


def data_files(folder: Path, information: dict[str, Any]) -> list[Path]:
    """Return the mcap files that the content of a folder's metadata.yaml names.

    Raises:
        BagError: it names none, too many, one twice, one that is not there, or one outside of the folder.
    """
    names = information.get("relative_file_paths")
    if not isinstance(names, list) or not 0 < len(names) <= MAX_FILES:
        raise BagError("AMX6813", folder / METADATA_FILE, "names no data files (relative_file_paths)")
    for name in names:
        if not isinstance(name, str) or "\0" in name or PurePath(name).name != name or name in {"", ".", ".."}:
            raise BagError(
                "AMX6813", folder / METADATA_FILE, f"names a data file outside of its folder: {str(name)[:80]!r}"
            )
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        hint = "`automax bag repair` writes metadata.yaml again"
        raise BagError("AMX6813", folder / METADATA_FILE, f"lists the data file {twice[:80]!r} twice", hint)
    missing = next((name for name in names if not (folder / name).is_file()), None)
    if missing is not None:
        if (folder / missing).exists():
            raise no_recording(folder / missing)
        raise BagError("AMX6810", folder, f"lacks the data file {missing[:80]!r} that metadata.yaml names")
    return [folder / name for name in names]
