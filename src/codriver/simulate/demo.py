"""A short drive to try codriver with: three minutes, everything in it, and its truth.

A start from standstill in a town, a climb, a bend, a descent with both pedals released, a give-way line, a strong
start onto a main road, a last stop; the wheel speeds are silent for 1.2 s on the climb. The same seed gives the same
drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from codriver.logs.frames import Frames
from codriver.signals import Log
from codriver.simulate.bus import BusParameters, Hole, transmit, write_trace
from codriver.simulate.can_layout import dbc_text
from codriver.simulate.drive import Trace, drive
from codriver.simulate.network import MESSAGES, names_text
from codriver.simulate.road import demo_road
from codriver.simulate.sensors import Instruments, SensorParameters, measured_log
from codriver.simulate.truth import truth_log

DURATION = 180.0  # s
HOLE = Hole("Wheels", 41.0, 1.2)


@dataclass(frozen=True, eq=False)
class DemoDrive:
    """The demo drive.

    Attributes:
        trace: everything that happened, every 2 ms.
        truth: the reference, 100 Hz (see `truth_log`).
        measured: the sensors' signals by standard names, as if the bus were perfect.
        frames: the bus, with its jitter and losses.
    """

    trace: Trace
    truth: Log
    measured: Log
    frames: Frames


@dataclass(frozen=True)
class DemoFiles:
    """Paths of a written demo: `log` (BLF), its `dbc` and `names`, and the `truth` (Parquet)."""

    log: Path
    dbc: Path
    names: Path
    truth: Path


def demo_drive(seed: int = 1) -> DemoDrive:
    """Simulate the demo drive; takes about two seconds."""
    trace = drive(demo_road(), DURATION, seed=seed)
    sensors = SensorParameters()
    frames = transmit(Instruments(trace, sensors, seed), DURATION, BusParameters(holes=(HOLE,)), seed=seed)
    return DemoDrive(trace, truth_log(trace, bias=sensors.bias), measured_log(trace, sensors, seed=seed), frames)


def write_demo(folder: str | Path, seed: int = 1) -> DemoFiles:
    """Simulate the demo drive and write drive.blf, car.dbc, names.toml, truth.parquet into a folder, made if need be.

    Raises:
        LogError: a file cannot be written.
    """
    from codriver.logs.write import Column, write_table

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    demo = demo_drive(seed)
    files = DemoFiles(folder / "drive.blf", folder / "car.dbc", folder / "names.toml", folder / "truth.parquet")
    write_trace(files.log, demo.frames)
    files.dbc.write_text(dbc_text(MESSAGES, "simulated car"), encoding="utf-8")
    files.names.write_text(names_text(), encoding="utf-8")
    clock = demo.truth["longitudinal_speed"].time
    columns = [Column(signal.name, signal.values, signal.unit) for signal in demo.truth.values()]
    write_table(files.truth, clock, columns, {"source": demo.truth.source, "seed": str(seed)})
    return files
