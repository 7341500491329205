"""Stimuli files: entries by rack time, their verbs, waves."""
