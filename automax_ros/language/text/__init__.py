"""Splits a text into tokens and logical lines."""
