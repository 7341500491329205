"""Two recordings side by side: aligned in time, their differences, and how each responds to a step."""
