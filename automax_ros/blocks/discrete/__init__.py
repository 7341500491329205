"""Blocks of booleans, bits, counters and tables."""
