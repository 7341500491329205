"""What a recording holds, counted from its messages."""
