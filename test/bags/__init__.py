"""Tests of recordings: message bytes, writer, reader, export."""
