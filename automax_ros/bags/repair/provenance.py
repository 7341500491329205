"""Where a recording comes from, found again in its files when metadata.yaml is lost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mcap.records import Attachment, Metadata

from automax_ros.bags.reader import custom_data_of, told_information
from automax_ros.wire.rack_files import RACK_FILE, RackFile, fingerprint

_MAX_FILES = 200
_MAX_BYTES = 16 << 20


class Provenance:
    """Takes what the files of a recording tell of it, and answers with ``custom_data`` for metadata.yaml."""

    def __init__(self) -> None:
        self._told: dict[str, str] = {}
        self._files: dict[str, RackFile] = {}
        self._bytes = 0

    def take(self, record: Attachment | Metadata) -> None:
        """Look at an attachment or metadata record of a data file."""
        if isinstance(record, Metadata):
            information = None if self._told else told_information(record)
            if information is not None:
                self.take_information(information)
        elif record.name not in self._files and (record.name == RACK_FILE or record.name.endswith((".BLK", ".BAS"))):
            self._bytes += len(record.data)
            if self._bytes <= _MAX_BYTES and len(self._files) < _MAX_FILES:
                self._files[record.name] = RackFile(record.name, record.data.decode("utf-8", "replace"))

    def take_information(self, information: Mapping[str, Any]) -> None:
        """Look at a readable metadata.yaml, or its copy in a data file."""
        self._told = custom_data_of(information) or self._told

    def custom_data(self, rack: str) -> dict[str, str]:
        """Return what was told, or what can be found out of the files and the rack's name."""
        if self._told or not rack:
            return dict(self._told)
        return {"rack": rack, "fingerprint": f"{fingerprint(list(self._files.values())):016x}"}
