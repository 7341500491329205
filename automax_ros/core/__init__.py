"""Shared by all rooms: text, numbers, values and types of the AutoMax languages, integer time, diagnostics, YAML."""
