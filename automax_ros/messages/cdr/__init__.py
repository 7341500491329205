"""CDR, the byte form of ROS 2 messages."""
