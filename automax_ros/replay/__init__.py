"""Replay: recorded scans are executed again, with the recorded or with edited sources, and compared."""
