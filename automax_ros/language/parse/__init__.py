"""Parses logical lines to the syntax tree."""
