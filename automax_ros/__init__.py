"""A Reliance Electric AutoMax rack emulated as ROS 2 nodes.

The rooms of the package, ground floor first; each imports only from those before it:
core, blocks, language, runtime, drive, rack, bags, nodes, cli.
Only `nodes` and `cli` know ROS 2; without them this is a plain Python library.
"""

__version__ = "0.1.0"
