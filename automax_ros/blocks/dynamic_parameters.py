"""Parameters that several dynamic blocks have alike."""

from __future__ import annotations

from automax_ros.blocks.declaration import Form, Input, Output
from automax_ros.core.types import DataType

WM = Input("WM", DataType.REAL, "WM", "mapping frequency in rad/s, (2 pi / T) / 20 unless given", form=Form.LITERAL)
RESET = Input("RESET", DataType.BOOLEAN, "R", "TRUE holds OUTPUT at INITIAL_VALUE", default=False)
SATURATED = (
    Output("SATURATED_PLUS", DataType.BOOLEAN, "SP", "TRUE if OUTPUT reaches LIMIT_PLUS", required=False),
    Output("SATURATED_MINUS", DataType.BOOLEAN, "SM", "TRUE if OUTPUT reaches LIMIT_MINUS", required=False),
)
