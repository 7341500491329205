"""Recordings that were cut or damaged: what is sound is saved."""
