"""The plants of a running rack: their time, and their signals in commons."""
