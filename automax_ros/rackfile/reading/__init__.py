"""Reads the values, names, scales and files in a rack file."""
