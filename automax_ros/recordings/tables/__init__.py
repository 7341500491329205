"""Recordings as tables: commons over time, scans, locals, signals of plants."""
