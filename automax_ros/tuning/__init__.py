"""What the coefficients of dynamic blocks mean: corners, step and frequency responses."""
