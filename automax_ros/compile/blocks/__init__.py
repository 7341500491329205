"""How the step function of a block becomes part of a scan: folded, inlined, its coefficients computed."""
