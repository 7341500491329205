"""A rack that runs: modules, common memory, tasks and their schedule. No ROS here."""
