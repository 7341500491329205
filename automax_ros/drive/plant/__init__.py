"""The plant of one drive, what can be done to it, and what its 57C406 measures and fires."""
