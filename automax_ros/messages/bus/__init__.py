"""What the processes of one rack exchange."""
