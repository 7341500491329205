"""DC drives: the line, the SCR bridge, the motor, the 57C406's current minor loop, the PMI of a UDC."""
