"""Replay by columns: thousands of scans at once."""
