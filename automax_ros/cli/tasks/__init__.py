"""Subcommands for single tasks: check, compile, trace, response, tune-info and others."""
