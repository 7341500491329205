"""What a rack file means, as frozen dataclasses."""
