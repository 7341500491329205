"""The mcap file format and what a recording says of itself."""
