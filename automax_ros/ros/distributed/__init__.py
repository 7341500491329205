"""A rack in several processes: its bus, who is there, requests passed on."""
