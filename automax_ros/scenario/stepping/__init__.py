"""A rack that goes on by ticks, scans and BASIC lines."""
