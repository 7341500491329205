"""Compiles a checked program to Python functions, and those to machine code."""
