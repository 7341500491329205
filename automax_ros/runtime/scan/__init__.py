"""One scan: what it reads and writes, how long it takes, its errors, events and channels."""
