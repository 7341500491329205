"""Synchronizes the processes of a distributed rack."""
