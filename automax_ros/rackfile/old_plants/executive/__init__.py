"""Reads the databases of the Programming Executive 3.x and 4.x (dBASE III tables) and makes rack files of them."""
