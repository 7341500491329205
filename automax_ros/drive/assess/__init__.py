"""Judges the set-up of a drive by the manual's formulas."""
