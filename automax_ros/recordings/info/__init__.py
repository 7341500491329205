"""The contents of a recording, counted from its messages."""
