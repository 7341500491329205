"""Scans as machine code: translated to C, compiled, kept in a cache, called."""
