"""The plant of one drive, its verbs and signals, and the measuring and firing of its 57C406."""
