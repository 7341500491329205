"""Recorded scans executed again and compared: with the recorded sources, or with edited ones."""
