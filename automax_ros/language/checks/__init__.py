"""The checker: from the text of a task to a checked program."""
