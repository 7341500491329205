"""`automax` with a window: writes the rack time of the latest scan into a file, which outlives a killed process.

Arguments: that file, the largest size of a file that may be written (0 for no limit), then those of `automax`.
"""

from __future__ import annotations

import mmap
import os
import resource
import struct
import sys

from automax_ros.cli.main import main
from automax_ros.messages.stream.stream import RackStream

if __name__ == "__main__":
    descriptor = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
    os.ftruncate(descriptor, mmap.PAGESIZE)
    page = mmap.mmap(descriptor, mmap.PAGESIZE)
    scanned = RackStream.scanned

    def told(self, task, record, writes):
        page[:8] = struct.pack("<q", record.time_ns)
        scanned(self, task, record, writes)

    RackStream.scanned = told
    if int(sys.argv[2]):
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
    sys.exit(main(sys.argv[3:]))
