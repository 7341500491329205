"""The configuration in a rack file, as frozen dataclasses."""
