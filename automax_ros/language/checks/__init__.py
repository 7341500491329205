"""Tree to checked Program: the checker, and one file for each of its rules."""
