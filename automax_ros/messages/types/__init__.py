"""The messages as Python tuples, their topics and their definitions."""
