"""The scheduler in integer nanoseconds, and what lets its time pass."""
