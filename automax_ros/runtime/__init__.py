"""What executes tasks: common memory, time, scans."""
