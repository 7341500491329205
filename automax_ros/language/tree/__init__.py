"""The syntax tree of a task, and data shared by parsing and checking."""
