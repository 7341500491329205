"""A running rack: modules, common memory, tasks and their schedule. Independent of ROS 2."""
