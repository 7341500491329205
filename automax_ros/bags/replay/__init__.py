"""Replay: every recorded scan executed again and compared."""
