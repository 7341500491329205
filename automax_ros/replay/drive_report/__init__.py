"""What a recording tells of its drives and of its rack, for `automax report`."""
