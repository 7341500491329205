"""Instructions of the Logix controllers that replace control blocks."""
