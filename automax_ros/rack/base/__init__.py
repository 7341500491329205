"""What the parts of a running rack share: observers, views of memory, why it stopped."""
