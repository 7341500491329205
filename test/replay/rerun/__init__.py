"""Tests of `automax_ros.replay.rerun`."""
