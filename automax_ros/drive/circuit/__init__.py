"""The power circuit: line, SCRs, conduction from event to event, in closed form."""
