"""The scheduler in integer nanoseconds, and the pacers that advance its time."""
