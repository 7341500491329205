"""A rack's messages: types, bytes, the stream of a run, the bus of a distributed rack."""
