"""Numbered parameters: INPUT1 to INPUT8 and their like."""

from __future__ import annotations

from automax_ros.blocks.declaration import Input
from automax_ros.core.types import DataType, Value


def input_channels(
    stem: str, count: int, kind: DataType, symbol: str, text: str, *, required: int, unused: Value
) -> tuple[Input, ...]:
    """Return the inputs ``stem``1 to ``stem``count, of which the first ``required`` must be programmed.

    Name, symbol and text get the channel's number. A channel that is not programmed has the value ``unused``, which
    must leave the block's result as it is.
    """
    return tuple(
        Input(
            f"{stem}{channel}",
            kind,
            f"{symbol}{channel}",
            f"{text} {channel}",
            required=channel <= required,
            default=None if channel <= required else unused,
        )
        for channel in range(1, count + 1)
    )
