"""The configuration of a rack from its YAML file: read, checked, frozen. Nothing here runs."""
