"""Tests of the example racks."""
