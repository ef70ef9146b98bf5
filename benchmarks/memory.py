"""How much memory an hour of a busy bus takes: 2,000 frames/s, read, estimated and written by the command."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from car_log import write_car_log
from measure import Row, say
from start import estimate_command

LIMIT = 1.5  # GiB

# The peak of this process alone: ru_maxrss would start from that of the process that started it.
_PROGRAM = """
import sys, time
from codriver.cli import main
start = time.perf_counter()
try:
    main()
finally:
    took = time.perf_counter() - start
    try:
        peak = next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM"))
    except OSError:
        import resource
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"peak {peak} kB in {took} s", file=sys.stderr)
"""


def run(quick: bool = False) -> Iterator[Row]:
    """One row."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        say("  writing the log")
        log = write_car_log(folder, 180 if quick else 3600)
        say(f"  estimating {log.frames} frames")
        command = [sys.executable, "-c", _PROGRAM, *estimate_command(log, "intent-pedals", folder / "out.parquet")]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        words = done.stderr.strip().splitlines()[-1].split()
        peak, took = int(words[1]) / 2**20, float(words[4])
        size = log.blf.stat().st_size / 1e6
        yield Row(
            f"memory of codriver estimate, {log.frames} frames", f"{peak:.2f} GiB", target=f"under {LIMIT} GiB",
            met=peak < LIMIT, note=f"peak resident size; {log.seconds:g} s of log, BLF of {size:.0f} MB, {took:.1f} s in all",
        )  # fmt: skip
