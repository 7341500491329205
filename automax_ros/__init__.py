"""A Reliance Electric AutoMax rack emulated as ROS 2 nodes.

The rooms of the package, ground floor first; each imports only from those before it:
core, pieces, blocks, logix, language, compile, drive, running, tuning, rack, wire, bags, replay, sweep, nodes, cli.
Only `nodes` and `cli` know ROS 2; without them this is a plain Python library. A room's names are imported from the
room: `from automax_ros.rack import Rack, load`.
"""

from automax_ros.core import compiled

__version__ = "0.1.0"

compiled.install(__path__[0])
