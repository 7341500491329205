"""The Control Block Language and BASIC: from the text of a task to a checked program, and back to text."""
