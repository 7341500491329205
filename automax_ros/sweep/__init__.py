"""Runs a rack many times in simulated time with different values, and measures each run."""
