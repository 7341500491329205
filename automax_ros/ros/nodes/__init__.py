"""A node per module, the operator, the rack's tables; `registry` says which module has which."""
