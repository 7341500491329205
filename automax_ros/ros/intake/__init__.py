"""Incoming messages and requests: bounded, read without holding the interpreter, between two scans."""
