"""The mcap file format and the metadata of recordings."""
