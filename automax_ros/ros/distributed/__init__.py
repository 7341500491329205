"""A rack in several processes: its bus, the presence of its processes, forwarded requests."""
