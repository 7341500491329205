"""Tasks of a running rack: installed, triggered, counted."""
