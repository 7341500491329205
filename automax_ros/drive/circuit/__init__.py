"""The power circuit in closed form: line, SCRs, conduction from event to event."""
