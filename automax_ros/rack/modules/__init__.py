"""The modules of a running rack; `building` joins them to their configurations."""
