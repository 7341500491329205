"""Repair of recordings whose writer was killed, or that were damaged."""
