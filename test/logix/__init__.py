"""Tests of the Logix instructions."""
