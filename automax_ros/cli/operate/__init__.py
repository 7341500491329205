"""`automax ctl`: one action, or many at a prompt."""
