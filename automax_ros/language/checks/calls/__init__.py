"""Checks of CALL: the block, its parameters, what its rules say of them."""
