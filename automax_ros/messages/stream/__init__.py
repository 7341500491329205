"""What a running rack sends, as messages and as their bytes."""
