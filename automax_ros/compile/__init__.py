"""A checked program becomes Python functions, and those become machine code."""
