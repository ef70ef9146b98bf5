"""A short drive to try codriver with: three minutes, everything in it, and its truth.

A start from standstill in a town, a climb, a bend, a descent with both pedals released, a give-way line, a strong
start onto a main road, a last stop; the wheel speeds are silent for 1.2 s on the climb. The same seed gives the same
drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from codriver.logs.frames import Frames
from codriver.signals import Log
from codriver.simulate.bus import BusParameters, Hole, transmit, write_trace
from codriver.simulate.can_layout import dbc_text
from codriver.simulate.car import GRAVITY
from codriver.simulate.drive import Trace, drive
from codriver.simulate.folder import refuse_foreign, write_folder
from codriver.simulate.network import MESSAGES, names_text
from codriver.simulate.road import demo_road
from codriver.simulate.sensors import Instruments, SensorParameters, measured_log
from codriver.simulate.truth import truth_log

DURATION = 180.0  # s
HOLE = Hole("Wheels", 41.0, 1.2)
# The logger's columns: name, signal, factor to its unit, decimals. It counts braking as positive.
_LOGGER = (
    ("VehSpd", "longitudinal_speed", 3.6, 2),
    ("AccX_g", "longitudinal_acceleration", -1 / GRAVITY, 4),
    ("TqEng", "engine_torque", 1.0, 1),
    ("TqDrv", "engine_torque_request", 1.0, 1),
    ("GearAct", "gear", 1.0, 0),
)


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
    """Paths of a written demo: `log` (BLF), its `dbc` and `names`, the `truth` (Parquet), and a `logger`'s CSV."""

    log: Path
    dbc: Path
    names: Path
    truth: Path
    logger: Path


def demo_drive(seed: int = 1) -> DemoDrive:
    """Simulate the demo drive; takes about two seconds."""
    trace = drive(demo_road(), DURATION, seed=seed)
    sensors = SensorParameters()
    frames = transmit(Instruments(trace, sensors, seed), DURATION, BusParameters(holes=(HOLE,)), seed=seed)
    return DemoDrive(trace, truth_log(trace, bias=sensors.bias), measured_log(trace, sensors, seed=seed), frames)


def write_demo(folder: str | Path, seed: int = 1) -> DemoFiles:
    """Simulate the demo drive and write it into a folder, made if need be.

    The files are drive.blf, car.dbc, names.toml, truth.parquet and logger.csv. They are written whole or not at all:
    everything goes to a temporary folder first.

    Raises:
        UsageError: the folder holds files, and not those of a demo.
        LogError: a file cannot be written.
    """
    folder = Path(folder)
    refuse_foreign(folder, "demo")
    demo = demo_drive(seed)
    write_folder(folder, lambda scratch: _write(demo, _files(scratch), seed), "demo")
    return _files(folder)


def _files(folder: Path) -> DemoFiles:
    """The files of a demo in a folder."""
    names = ("drive.blf", "car.dbc", "names.toml", "truth.parquet", "logger.csv")
    return DemoFiles(*(folder / name for name in names))


def _write(demo: DemoDrive, files: DemoFiles, seed: int) -> None:
    """All files of a demo."""
    from codriver.logs.write import Column, write_table

    write_trace(files.log, demo.frames)
    files.dbc.write_text(dbc_text(MESSAGES, "simulated car"), encoding="utf-8")
    files.names.write_text(names_text(), encoding="utf-8")
    clock = demo.truth["longitudinal_speed"].time
    columns = [Column(signal.name, signal.values, signal.unit) for signal in demo.truth.values()]
    write_table(files.truth, clock, columns, {"source": demo.truth.source, "seed": str(seed)})
    files.logger.write_text(_logger_text(demo.measured), encoding="utf-8")


def _logger_text(measured: Log) -> str:
    """Two minutes at 50 Hz as a logger of its own kind writes them: no standard names, no units, a sign turned."""
    grid = measured.sample([signal for _, signal, _, _ in _LOGGER], 0.02, start=0.05, stop=120.0)
    # Adding 0 turns -0 into 0.
    columns = [np.round(grid.values[signal] * factor, decimals) + 0.0 for _, signal, factor, decimals in _LOGGER]
    form = ",".join(["{:.2f}", *(f"{{:.{decimals}f}}" for *_, decimals in _LOGGER)])
    rows = [form.format(*row) for row in zip(grid.time.tolist(), *(c.tolist() for c in columns), strict=True)]
    return "\n".join([",".join(["t", *(name for name, *_ in _LOGGER)]), *rows, ""])
