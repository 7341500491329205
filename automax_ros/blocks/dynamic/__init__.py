"""Blocks with a transfer function: filters, integrators, PID, protection."""
