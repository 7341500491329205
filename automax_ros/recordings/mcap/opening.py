"""Opens the files of recordings: regular files only, so that a pipe in a recording's folder does not block."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path

from automax_ros.rackfile.reading.files import FileFault, open_regular
from automax_ros.recordings.mcap.errors import BagError

NO_BAG_HINT = "give the folder of a recording, which holds metadata.yaml, or one .mcap file"


@contextmanager
def opened(path: Path) -> Iterator[BufferedReader]:
    """Open a file of a recording for as long as the block lasts.

    Raises:
        BagError: it is not a regular file or cannot be read, or the block runs out of memory.
    """
    try:
        with open_regular(path) as file:
            yield file
    except FileFault as error:
        raise BagError("AMX6810", path, str(error), NO_BAG_HINT) from error
    except OSError as error:
        raise BagError("AMX6810", path, f"cannot be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise BagError("AMX6814", path, "not enough memory for a record of this file") from error


def no_recording(path: Path) -> BagError:
    """Return the error for a path that is neither a folder nor a regular file."""
    what = "does not exist"
    if path.exists():
        what = "is not a regular file"
    elif path.is_symlink():
        what = "is not a regular file but a link that leads nowhere"
    return BagError("AMX6810", path, what, NO_BAG_HINT)


def size_of(file: Path) -> int:
    """Return the size of a file in bytes, at least 1; 1 if it is unknown."""
    try:
        return max(1, file.stat().st_size)
    except OSError:
        return 1
