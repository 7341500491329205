"""What compiled code is made of: state, names, syntax trees, costs, functions that it calls."""
