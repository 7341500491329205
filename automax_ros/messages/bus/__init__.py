"""The messages that the processes of one rack exchange."""
