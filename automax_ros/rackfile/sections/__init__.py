"""The sections of a rack file: tasks, common variables, points, plants."""
