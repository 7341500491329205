"""A rack's memory and its running tasks: memory, task, scheduler, error log."""
