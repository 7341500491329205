"""What the nodes of all modules share: the node, topics that write, lifecycle, diagnostics, the clock."""
