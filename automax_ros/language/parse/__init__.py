"""Logical lines to the syntax tree."""
