"""How long a user waits: for the help, the demo, and a first estimate.

codriver keeps no cache of its own, so what a first run can lack is Python's bytecode. pip compiles it as it installs, so
after `pip install` nothing is left to do; installers that leave it to the first run make that run compile every module it
imports, which the last row shows with an empty cache. cantools imports python-can, which imports asammdf where it is
installed, and that pandas and more; a plain install lacks both, so they are hidden from those runs. The machine's file
cache is warm throughout.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from car_log import CarLog, write_car_log
from measure import Row, duration, say

_PROGRAM = """
import sys
sys.modules["asammdf"] = sys.modules["pandas"] = None
from codriver.cli import main
main()
"""
CODRIVER = [str(Path(sys.executable).with_name("codriver"))]
PLAIN = [sys.executable, "-c", _PROGRAM]


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    yield _timed("codriver --help", ["--help"], 0.4, 5)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield _timed("codriver demo", ["demo", "--out", str(folder / "demo")], 20, 1 if quick else 3)
        say("  writing a log")
        log = write_car_log(folder, 60 if quick else 600)
        command = estimate_command(log, "kinematic" if quick else "intent-pedals", folder / "out.parquet")
        text = f"codriver estimate, {log.seconds:g} s log of {log.frames} frames"
        times = 1 if quick else 5
        yield _timed(f"{text}, asammdf and pandas there", command, 4, times)
        yield _timed(f"{text}, plain install", command, 4, times, "bytecode there, as after pip install", program=PLAIN)
        empty = {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPYCACHEPREFIX": str(folder / "nothing")}
        note = "every module that is imported is compiled anew"
        yield _timed(f"{text}, plain install, no bytecode", command, 4, times, note, empty, PLAIN)


def estimate_command(log: CarLog, estimator: str, out: Path) -> list[str]:
    """The arguments that estimate a written log."""
    return [
        "estimate", estimator, str(log.blf), "--dbc", str(log.dbc), "--names", str(log.names), "--vehicle", "bisoffi2017",
        "-o", str(out),
    ]  # fmt: skip


def _timed(
    what: str,
    arguments: list[str],
    limit: float,
    times: int,
    note: str = "",
    more: dict[str, str] | None = None,
    program: list[str] = CODRIVER,
) -> Row:
    """The median time of a command."""
    say(f"  {what}")
    took = []
    for _ in range(times):
        start = time.perf_counter()
        subprocess.run([*program, *arguments], check=True, capture_output=True, env={**os.environ, **(more or {})})
        took.append(time.perf_counter() - start)
    middle = statistics.median(took)
    spread = f"median of {times}, {duration(min(took))} to {duration(max(took))}"
    return Row(
        what, duration(middle), target=f"under {limit:g} s", met=middle < limit,
        note=f"{spread}; {note}" if note else spread,
    )  # fmt: skip
