"""The kinds of module that a rack file may name, and their configurations."""
