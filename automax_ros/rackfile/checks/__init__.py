"""Rules among the tasks, modules and drives of a rack."""
