"""The control blocks of J-3676-5, a family a file; each is declared once as data plus one step function."""
