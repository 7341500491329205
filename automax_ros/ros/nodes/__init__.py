"""A node per module, the operator, the rack's tables; `registry` maps modules to nodes."""
