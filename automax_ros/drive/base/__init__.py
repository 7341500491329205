"""What the parts of a drive share: the motor and its plate, sensors, states, errors."""
