"""Analyses the coefficients of dynamic blocks: corners, step and frequency responses."""
