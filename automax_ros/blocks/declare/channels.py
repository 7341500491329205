"""Numbered parameters, such as INPUT1 to INPUT8."""

from __future__ import annotations

from collections.abc import Iterable

from automax_ros.blocks.declare.declaration import Input, Output
from automax_ros.core.types import DataType, Value

MOST_CHANNELS = 8
"""Largest number of channels of a block with INPUT1, INPUT2 ..."""


def input_channels(
    stem: str,
    count: int,
    kind: DataType,
    symbol: str,
    text: str,
    *,
    required: int,
    unused: Value | None,
    first: int = 1,
) -> tuple[Input, ...]:
    """Return ``count`` inputs ``stem``1, ``stem``2 ..., of which the first ``required`` must be programmed.

    Name, symbol and text get the channel's number, counted from ``first``. A channel that is not programmed has the
    value ``unused``, which must not change the block's result; None makes it optional.
    """
    return tuple(
        Input(
            f"{stem}{channel}",
            kind,
            f"{symbol}{channel}",
            f"{text} {channel}",
            required=channel < first + required,
            default=None if channel < first + required else unused,
        )
        for channel in range(first, first + count)
    )


def output_channels(
    stem: str, count: int, kind: DataType, symbol: str, text: str, *, required: int, holds: bool = False, first: int = 1
) -> tuple[Output, ...]:
    """Return ``count`` outputs ``stem``1, ``stem``2 ..., of which the first ``required`` must be programmed."""
    return tuple(
        Output(
            f"{stem}{channel}", kind, f"{symbol}{channel}", f"{text} {channel}", channel < first + required, holds=holds
        )
        for channel in range(first, first + count)
    )


def paired(inputs: tuple[Input, ...], others: tuple[Input, ...]) -> tuple[Input, ...]:
    """Return the channels of two groups of inputs alternately, as in the manual's statements."""
    return tuple(item for pair in zip(inputs, others, strict=True) for item in pair)


def names(stem: str, count: int, first: int = 1) -> tuple[str, ...]:
    """Return the names of channels."""
    return tuple(f"{stem}{channel}" for channel in range(first, first + count))


def programmed_channels(keywords: Iterable[str]) -> int:
    """Return which of INPUT1, INPUT2 ... are among the keywords, as the bits 0, 1 ... of a number."""
    channels = (name.removeprefix("INPUT") for name in keywords if name.startswith("INPUT"))
    return sum(1 << (int(channel) - 1) for channel in channels if channel.isdigit() and channel != "0")
