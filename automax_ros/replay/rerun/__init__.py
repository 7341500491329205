"""A recorded run again in closed loop, with an edit: what came from outside happens again at its time."""
