"""SCAN_LOOP, and the execution times of END and remarks (sections 4 and 53)."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import Block, BlockTimes, Form, Input, Platform, Special, Time
from automax_ros.core.ticks import MAX_TICKS

SCAN_LOOP = Block(
    name="SCAN_LOOP",
    section="4",
    title="Scan loop",
    function="Runs the task every TICKS x tick rate, or on EVENT, and latches its simple common variables",
    inputs=(
        Input.integer(
            "TICKS",
            "TICKS",
            "ticks from scan to scan, also where EVENT starts the scan; at most 20 on a UDC",
            form=Form.LITERAL,
            low=1,
            high=MAX_TICKS,
        ),
        Input(
            "EVENT",
            Special.EVENT,
            "EVENT",
            "name of the event, defined by an EVENT statement, that starts a scan",
            runs_on=frozenset({Platform.AUTOMAX}),
        ),
    ),
    outputs=(),
    times=BlockTimes(
        Time(80.00, t=1.6, i=2.5, b=3.8, d=4.1),
        Time(326.0, t=2.4, i=4.4, b=6.8, d=7.2),
        Time(350.00, i=2.20, b=2.00, d=3.30, alone=312.0),
        # Table 6 lost terms here: every PC3000 time is taken as 0.7 of the 7010's (decision)
        Time(56.00, t=1.12, i=1.76, b=2.68, d=2.88),
    ),
    notes=(
        "The first block of every task, called once; a GOTO may reach neither it nor a line before it.",
        "Statements before it run once, when the task is put into RUN.",
    ),
    step=None,
    begins_scan=True,
)

END_TIMES = BlockTimes(
    Time(13.82, t=2.0, i=1.6, b=2.2, d=2.5),
    Time(60.0, t=3.2, i=2.8, b=4.3, d=4.9),
    Time(130.00, i=2.40, b=2.50, d=3.30, alone=100.0),
    Time(9.68, t=1.40, i=1.12, b=1.56, d=1.76),
)
"""Execution times of the END statement: commit of the latched variables (tables 4 to 6)."""

REMARK_TIMES = BlockTimes(Time(9.88), Time(40.0), Time(2.37), Time(6.92))
"""Execution times of each ``!`` remark after SCAN_LOOP; REM takes none (53, tables 4 to 6)."""
