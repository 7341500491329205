"""What must hold among tasks, modules and drives of a rack."""
