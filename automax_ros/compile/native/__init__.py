"""Scans as machine code: translated to C, compiled, cached, called."""
