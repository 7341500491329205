"""What the tests of the Logix instructions share."""

from hypothesis import settings

BITS = ("InstructFault", "WordSizeInv", "OutOverflow", "LostPrecision", "MultiplierInv")
"""PMUL's status bits by their numbers."""

repeatable = settings(deadline=None, derandomize=True, max_examples=200, database=None)


def set_bits(tag):
    return {name for name in BITS if getattr(tag, name)}
