"""From a checked program to a running task: memory, compiler, task, scheduler, cost."""
