"""Recordings of runs: rosbag2 folders of mcap files, written, read, exported, repaired."""
