"""What a person asks of a rack: requests in words, switches, halting, what outlives the power."""
