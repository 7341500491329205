"""Recordings by time and by scan: all values at any time, any scan executed again, two recordings compared."""
