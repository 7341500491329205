"""Operations and signals of a rack from a file or by hand, and the report of a run's end."""
