"""Operations on a rack: RUN, STOP, set, force, power."""
