"""Instructions of the Logix controllers that take the place of control blocks."""
