"""`automax run` and `automax node`: a rack in this process, or distributed over several."""
