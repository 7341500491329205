"""The catalogue: every block by its name."""

from __future__ import annotations

from automax_ros.blocks.declaration import Block
from automax_ros.blocks.families import FAMILIES

CATALOGUE: dict[str, Block] = {
    block.name: block
    for block in sorted((block for family in FAMILIES for block in family.blocks), key=lambda block: block.name)
}
"""Every control block, in alphabetical order."""
