"""Steps a rack by ticks, scans and BASIC lines."""
