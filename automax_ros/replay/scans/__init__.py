"""Replay scan by scan: what a scan saw, and what differs."""
