"""A rack run many times in simulated time with other values, each run measured."""
