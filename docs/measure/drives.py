"""Simulated drives that the figures in docs/ are measured on: the demo drive with other seeds, read back from its CAN trace."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import codriver as cd
from codriver.simulate import DemoDrive, demo_drive
from codriver.simulate.bus import write_trace
from codriver.simulate.can_layout import dbc_text
from codriver.simulate.network import MESSAGES, names_text


@dataclass(frozen=True, eq=False)
class Driven:
    """One drive: its seed, what the bus brought, what was true, and all of the simulation."""

    seed: int
    log: cd.Log
    truth: cd.Log
    demo: DemoDrive


def drives(seeds: Iterable[int]) -> Iterator[Driven]:
    """Simulate, write as BLF with its DBC, and read back; some four seconds a drive."""
    for seed in seeds:
        demo = demo_drive(seed)
        with tempfile.TemporaryDirectory() as folder:
            trace, dbc, names = (Path(folder) / name for name in ("drive.blf", "car.dbc", "names.toml"))
            write_trace(trace, demo.frames)
            dbc.write_text(dbc_text(MESSAGES, "simulated car"), encoding="utf-8")
            names.write_text(names_text(), encoding="utf-8")
            log = cd.read(trace, dbc=dbc, names=names)
        yield Driven(seed, log, demo.truth, demo)


def rms(x: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def onto(truth: cd.Log, name: str, time: np.ndarray) -> np.ndarray:
    """A true signal at other times."""
    return np.interp(time, truth[name].time, truth[name].values)


def table(header: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(row) + " |" for row in [header, ["---"] * len(header), *rows]]
    return "\n".join(lines)
