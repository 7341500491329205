"""Checks of everything else: declarations, statements, expressions, the flow of a task."""
