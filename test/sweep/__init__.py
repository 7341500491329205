"""Tests of ``automax_ros.sweep``."""
