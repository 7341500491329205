"""One process's part of a rack tied to the others."""
