"""Tasks of a running rack: installation, triggers, statistics."""
