"""The parts of compiled code: state, names, syntax trees, costs, functions that it calls."""
