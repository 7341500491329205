"""Shared by the parts of a running rack: observers, views of memory, the cause of a stop."""
