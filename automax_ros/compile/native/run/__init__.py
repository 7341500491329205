"""Builds a shared library from C, and calls its functions scan by scan or by columns."""
