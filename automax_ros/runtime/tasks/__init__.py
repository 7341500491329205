"""Tasks of each kind: control blocks, BASIC, the current minor loop of a drive."""
