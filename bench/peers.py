"""This emulator compared with others that install from registries, in one run; those not installed are left out.

    pip install mcap motulator          (the simulator needs numpy and scipy)
    apt install ngspice

- a DC motor of 150 hp on a six-pulse bridge at rated torque: our circuit in closed form, ngspice with its switches;
- motulator, the nearest simulator of drives in Python: an induction motor with V/Hz control (it has no SCR bridge);
- messages of 100 bytes into an mcap file: our writer, and that of mcap.

No compiler of IEC 61131-3 installs from PyPI, npm, crates.io or Debian (crates.io has a parser): bench/native.py
compares our native scans with the plain Python ones instead.
"""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import drive

PULSES = 6
SPICE_SECONDS = 0.25
MOTULATOR_SECONDS = 1.0
DRIVE_SECONDS = 4.0
MESSAGES = 100_000
PAYLOAD = bytes(range(100))
REPEATS = 3


def spice_netlist() -> str:
    """Return the circuit of ``drive.drive`` with a fixed delay of 30 degrees and the resulting speed."""
    data, volts, source_h = drive.PARAMETERS.motor, drive.PARAMETERS.line_v, drive.PARAMETERS.source_h
    peak, hz = volts * (2 / 3) ** 0.5, 60.0
    lines = ["six-pulse bridge and DC motor"]
    for phase, lag in zip("abc", (0, 120, 240), strict=True):
        lines += [
            f"v{phase} n{phase} 0 sin(0 {peak} {hz} 0 0 {-lag})",
            f"l{phase} n{phase} m{phase} {source_h}",
            f"r{phase} m{phase} {phase} {drive.SOURCE_OHM}",
        ]
    period = 1 / hz
    # A gate conducts for 120 degrees from 30 degrees after its natural commutation, which is at 30 degrees of phase a.
    gates = zip((("a", "p"), ("n", "c"), ("b", "p"), ("n", "a"), ("c", "p"), ("n", "b")), range(PULSES), strict=True)
    for (left, right), number in gates:
        name, delay = f"{left}{right}", period * ((60 + 60 * number) % 360) / 360
        lines += [
            f"vg{name} g{name} 0 pulse(0 1 {delay} 1u 1u {period / 3} {period})",
            f"s{name} {left} k{name} g{name} 0 gate off",
            f"d{name} k{name} {right} valve",
            f"rs{name} k{name} {left} 1meg",
        ]
    torque_a = drive.TORQUE / data.k_v_s
    lines += [
        f"rarm p x {data.resistance_ohm}",
        f"lm x y {data.inductance_h} ic={torque_a}",
        "vm y e 0",
        # Speed as the voltage of a capacitor: the integral of the excess torque over the inertia.
        f"be e n v=v(w)*{data.k_v_s}",
        f"bw 0 w i=i(vm)*{data.k_v_s}-{drive.TORQUE}-v(w)*{data.viscous_n_m_s}",
        f"cw w 0 {data.inertia_kg_m2} ic={drive.START_RAD_S}",
        "rn n 0 10k",
        ".model gate sw(vt=0.5 vh=0.1 ron=1m roff=1meg)",
        ".model valve d(n=0.01 rs=1m)",
        ".options method=gear reltol=1e-3 abstol=1m vntol=1m",
        f".tran 20u {SPICE_SECONDS} 0 20u uic",
        ".print tran v(w)",
        ".end",
    ]
    return "\n".join(lines) + "\n"


def spice() -> float | None:
    """Return simulated seconds per wall second of ngspice, None where it is not installed."""
    program = shutil.which("ngspice")
    if program is None:
        return None
    with tempfile.TemporaryDirectory() as temporary:
        netlist = Path(temporary) / "bridge.cir"
        netlist.write_text(spice_netlist())
        began = time.perf_counter()
        ended = subprocess.run([program, "-b", str(netlist)], capture_output=True, text=True, timeout=300, check=False)
        wall = time.perf_counter() - began
    rows = re.findall(r"^\d+\s+(\S+)\s+(\S+)", ended.stdout, re.MULTILINE)
    if ended.returncode or not rows or abs(float(rows[-1][0]) - SPICE_SECONDS) > 1e-3:
        raise SystemExit(f"ngspice did not simulate the bridge:\n{ended.stdout[-800:]}{ended.stderr[-800:]}")
    return SPICE_SECONDS / wall


def motulator() -> float | None:
    """Return the same for motulator, with its own example of a 2.2 kW motor."""
    if importlib.util.find_spec("motulator") is None:
        return None
    import motulator.drive.control.im as control  # type: ignore[import-not-found,unused-ignore]
    from motulator.drive import model
    from motulator.drive.utils import InductionMachineInvGammaPars, InductionMachinePars

    given = InductionMachineInvGammaPars(n_p=2, R_s=3.7, R_R=2.1, L_sgm=0.021, L_M=0.224)
    machine = model.InductionMachine(InductionMachinePars.from_inv_gamma_model_pars(given))
    drive_model = model.Drive(model.VoltageSourceConverter(u_dc=540), machine, model.StiffMechanicalSystem(J=0.015))
    settings = control.VHzControlCfg(given, nom_psi_s=1.04, k_u=1, k_w=4)
    controller = control.VHzControl(settings)
    controller.ref.w_m = lambda t: (t > 0.1) * 314.0
    simulation = model.Simulation(drive_model, controller)
    began = time.perf_counter()
    simulation.simulate(t_stop=MOTULATOR_SECONDS)
    return MOTULATOR_SECONDS / (time.perf_counter() - began)


def closed_form() -> float:
    """Return the same for our circuit at rated torque."""
    return max(DRIVE_SECONDS / drive.drive(1.0, 1.0, DRIVE_SECONDS)[0] for _ in range(REPEATS))


def own_writer(folder: Path) -> float:
    """Return messages per second of the writer of recordings, with metadata.yaml and zstd."""
    from automax_ros.messages.types.messages import NAMES, String
    from automax_ros.messages.types.topics import SCAN
    from automax_ros.recordings.write.writer import BagWriter

    began = time.perf_counter()
    with BagWriter(folder) as writer:
        channel = writer.channel("/line1/text", NAMES[String], SCAN)
        for number in range(MESSAGES):
            writer.write(channel, number, PAYLOAD)
    return MESSAGES / (time.perf_counter() - began)


def mcap_writer(folder: Path) -> float:
    """Return the same for the package mcap."""
    from mcap.writer import CompressionType, Writer

    folder.mkdir()
    began = time.perf_counter()
    with (folder / "scans_0.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start("ros2", "bench")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/line1/text", "cdr", schema)
        for number in range(MESSAGES):
            writer.add_message(channel, number, PAYLOAD, number, number)
        writer.finish()
    return MESSAGES / (time.perf_counter() - began)


def best_rates(writers: Sequence[Callable[[Path], float]]) -> list[float]:
    """Return the best of several files of each writer, in turn, in temporary folders."""
    with tempfile.TemporaryDirectory() as temporary:
        rates = [
            [writer(Path(temporary) / f"{kind}_{number}") for kind, writer in enumerate(writers)]
            for number in range(REPEATS)
        ]
    return [max(found) for found in zip(*rates, strict=True)]


def show(what: str, own: float, unit: str, peers: dict[str, float | None]) -> None:
    """Print our figure and its ratio to each peer's."""
    print(f"{what}: {own:,.0f} {unit}")
    for name, rate in peers.items():
        text = "not installed" if rate is None else f"{rate:,.3g} {unit}, ratio {own / rate:,.1f}"
        print(f"  {name:12} {text}")


def main() -> None:
    """Print the figures."""
    own = closed_form()
    show("150 hp drive", own, "simulated s per wall s", {"ngspice": spice(), "motulator": motulator()})
    own, mcap = best_rates((own_writer, mcap_writer))
    show("mcap, zstd", own, "messages/s", {"mcap": mcap})


if __name__ == "__main__":
    main()
