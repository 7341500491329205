"""What a rack's YAML file says: read, checked, frozen. Nothing here runs."""
