"""ROS 2 nodes: the only room, with the command line, that knows rclpy."""
