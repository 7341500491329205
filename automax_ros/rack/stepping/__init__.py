"""Stepping: a rack in simulated time, a tick, a scan, a BASIC line at a time, with breakpoints."""
