"""Shared by the parts of a drive: the motor and its name plate, sensors, states, errors."""
