"""Subcommands as data, for the reference and for completion in shells."""
