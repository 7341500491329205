"""Recordings: messages to and from rosbag2 folders, without ROS."""
