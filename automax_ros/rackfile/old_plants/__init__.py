"""Makes rack files from the remains of an old plant: configuration tasks, folders of sources."""
