"""Stimuli: what operator and process do to a rack, or to a lone task, by rack time; read whole before a run begins."""
