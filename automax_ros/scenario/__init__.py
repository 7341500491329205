"""What happens to a rack by a file or by hand, and the report of how it ended."""
