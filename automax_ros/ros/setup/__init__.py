"""ROS 2 in this process: environment, discovery, arguments, context and executor."""
