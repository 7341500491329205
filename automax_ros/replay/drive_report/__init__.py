"""Reports on the drives and the rack of a recording, for `automax report`."""
