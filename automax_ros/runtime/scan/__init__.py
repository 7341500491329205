"""One scan: its reads and writes, its duration, its errors, events and channels."""
