"""Replay scan by scan: the inputs of a scan, and the differences."""
