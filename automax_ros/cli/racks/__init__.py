"""Subcommands for rack files: new, import, load, step, sweep, drive-check and others."""
