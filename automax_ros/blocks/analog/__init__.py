"""Blocks of numbers without dynamics over frequency: arithmetic, averages, ramps, selection."""
