"""Instructions of the Logix controllers that replace AutoMax racks: what the AutoMax block becomes after a migration.

Structures and members have the controller's own spelling, so that a tag is read here as in Logix Designer.
"""
