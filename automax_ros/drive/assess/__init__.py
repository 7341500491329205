"""Judges how a drive is set up, by the manual's formulas."""
