"""Webs between drives: rolls, rollers and dancers, and the chains in which they pass time together."""
