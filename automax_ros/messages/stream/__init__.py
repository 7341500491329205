"""The messages that a running rack sends, and their bytes."""
