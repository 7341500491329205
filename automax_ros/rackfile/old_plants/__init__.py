"""Rack files made from what an old plant left: configuration tasks, folders of sources."""
