"""A recording executed again and compared."""
