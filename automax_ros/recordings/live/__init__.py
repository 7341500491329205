"""Recordings of a rack that runs elsewhere, made from its messages."""
