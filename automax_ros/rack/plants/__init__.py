"""The plants of a running rack: their time, their signals in commons."""
