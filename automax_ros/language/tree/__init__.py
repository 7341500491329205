"""The syntax tree of a task, and data that parsing and checking share."""
