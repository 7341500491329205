"""Block diagrams of tasks, drawn from the checked program."""
