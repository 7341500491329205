"""A rack as ROS 2 nodes. The only room, with the command line, that knows rclpy."""
