"""BASIC statements, CALLs and expressions as Python syntax trees."""
