"""Checks of CALL: the block, its parameters, and its rules for them."""
