"""Recordings written while a rack runs."""
