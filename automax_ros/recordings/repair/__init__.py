"""Repair of cut or damaged recordings: what is sound is saved."""
