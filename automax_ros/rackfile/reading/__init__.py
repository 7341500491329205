"""Values, names, scales and files as a rack file writes them."""
