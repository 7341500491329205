"""Recordings of a rack in another process, made from its messages."""
