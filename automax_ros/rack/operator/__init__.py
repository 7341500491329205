"""Requests of an operator to a rack: commands in words, switches, halting, state kept over the power."""
