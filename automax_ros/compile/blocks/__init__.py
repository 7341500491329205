"""Makes the step function of a block part of a scan: folded, inlined, its coefficients computed."""
