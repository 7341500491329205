"""Translates Python functions of a task to C, with the range of each value known."""
