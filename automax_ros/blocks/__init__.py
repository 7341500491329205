"""The control blocks of J-3676-5, one family per file; each is declared once as data plus one step function."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.blocks.catalogue import CATALOGUE
    from automax_ros.blocks.declaration import Block, Coefficients, Input, Output, Platform, Special
    from automax_ros.blocks.describe import description, template
    from automax_ros.blocks.instance import Instance, InstanceError
    from automax_ros.blocks.transfer import Transfer

__all__ = [
    "CATALOGUE",
    "Block",
    "Coefficients",
    "Input",
    "Instance",
    "InstanceError",
    "Output",
    "Platform",
    "Special",
    "Transfer",
    "description",
    "template",
]

__getattr__ = face(__name__, "declaration", "catalogue", "transfer", "instance", "describe")
