"""Subcommands for recordings: record, play, replay, bag, export, plot, report."""
