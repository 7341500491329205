"""Racks with drives for the tests of `automax drive-check` and `automax report`."""

from pathlib import Path

CALL = {
    "IO_CNTL_SLOT": "7", "DIG_IO_SLOT": "8", "REFERENCE": "REF%", "KP": "KP", "PI_W_LEAD": "50.0", "CML_RUN": "RUN@",
    "IOC_THRESH": "225", "LIM_BAR": "150", "SPEED_FDBK": "SPD%", "OSV_FDBK": "SPD%", "OSV_THRESH": "4505",
    "FAULT_RESET": "RESET@", "DC_CML_STATE": "STATE@", "I_FDBK": "CUR_FB%", "DELTA": "DELTA%", "BRIDGE_POL": "BRIDGE@",
    "IOC_OUT": "IOC@", "TACH_LOSS_OUT": "TACH@", "REF_LAG_OUT": "CUR_REF%",
}  # fmt: skip
COMMONS = ["REF%", "SPD%", "CUR_FB%", "DELTA%", "CUR_REF%", "RUN@", "RESET@", "STATE@", "BRIDGE@", "IOC@", "TACH@"]


def loop_task(*lines: str, slot: int = 7, **changes: str | None) -> str:
    """A task with a current minor loop; ``changes`` are other arguments of its CALL, None leaves one out.

    ``lines`` stand before the CALL.
    """
    given = {**CALL, "IO_CNTL_SLOT": str(slot), "DIG_IO_SLOT": str(slot + 1), **changes}
    arguments = ", ".join(f"{name}={text}" for name, text in given.items() if text is not None)
    declared = f"100 COMMON {', '.join(COMMONS)}\n110 LOCAL KP [CURRENT=0.5, HIGH=4.0, LOW=0.0, STEP=0.01], LEVEL%\n"
    before = "".join(f"{number} {line}\n" for number, line in enumerate(lines, 120))
    return f"{declared}{before}200 CALL DC_DRIVE_CML({arguments})\n300 END\n"


def rack_file(plant: str = "motor: dc_150hp_500v", *, more: str = "", slots: str = "", tasks: str = "") -> str:
    """A rack with one drive in slot 7, whose task is LOOP; ``more`` are further commons, one a line."""
    commons = "".join(f"  {name}: {{}}\n" for name in COMMONS)
    return (
        "rack: D1\nslots:\n  0: {module: 57C413}\n"
        f"  1: {{module: 57C435, tasks: {{LOOP: {{priority: 4}}{tasks}}}}}\n"
        "  7: {module: 57C406, plant: UNWIND}\n  8: {module: 57C408}\n"
        f"{slots}plants:\n  UNWIND: {{{plant}}}\ncommon:\n{commons}{more}"
    )


def write_rack(folder: Path, rack: str, **tasks: str) -> str:
    """Write a rack and its tasks into a folder; return the rack file's name."""
    (folder / "rack.yaml").write_text(rack)
    for name, text in tasks.items():
        (folder / f"{name}{'.BAS' if name.startswith('B_') else '.BLK'}").write_text(text)
    return "rack.yaml"
