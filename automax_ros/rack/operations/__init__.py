"""What is done to a rack: RUN, STOP, set, force, power."""
