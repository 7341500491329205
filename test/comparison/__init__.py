"""Tests of ``automax_ros.comparison``."""
