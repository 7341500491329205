"""Tests of the rack."""
