"""The modules of a running rack; `building` makes them from their configurations."""
