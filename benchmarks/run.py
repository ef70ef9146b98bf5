"""All benchmarks in one run: `python benchmarks/run.py [--quick] [--only NAME]`.

A full run writes RESULTS.md beside this file, with the machine it ran on; `--quick` (small inputs, to see that everything
works) and `--only` print the table alone, since ratios belong to one run. Everything runs on one thread. Interrupted, it
prints what it has.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Iterator
from datetime import date
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from measure import Row, duration, say

NAMES = (
    "start",
    "kernel",
    "live",
    "batch",
    "smoother",
    "steering",
    "motorcycle",
    "limits",
    "decode",
    "end_to_end",
    "memory",
    "identification",
    "learned",
)
LIBRARIES = (
    "codriver", "numpy", "scipy", "casadi", "llvmlite", "pyarrow", "cantools", "python-can", "asammdf", "pandas", "filterpy",
    "statsmodels", "numba", "scikit-learn", "hmmlearn", "gmr",
)  # fmt: skip
RESULTS = Path(__file__).with_name("RESULTS.md")
LIMITS = """## What limits the rest

* The loop of the constant form waits for its own last state: prediction, innovation, gain, and the selections for start and
  standstill follow one another, so a wider machine does not help and `-march=native` adds little to C either.
* The Kalman form has three times the arithmetic, and two divisions that wait for one another (each row's 1 / s).
* All outputs instead of the four estimates: the noise scale with its divisions and roots, and a store a column; with fresh
  arrays the system's clearing of new pages comes on top. `compile(observer, outputs=[...])` leaves out what is not asked for.
* The joint filters wait for divisions and roots: the EKF has 6 divisions in a row of 116 operations, the UKF 17 in 442.
* From BLF to Parquet, half of the time is unpacking and finding the frames; a cold start is imports (scipy, numpy, typer,
  cantools with python-can).
"""


def main() -> int:
    """Run, print, and write the results of a full run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small inputs; nothing is written")
    parser.add_argument("--only", choices=NAMES, help="one benchmark; nothing is written")
    chosen = parser.parse_args()
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[variable] = "1"  # the benchmarks start numpy, later
    rows: list[Row] = []
    begun, busy = time.perf_counter(), load()
    try:
        for name in (chosen.only,) if chosen.only else NAMES:
            say(f"{name}:")
            for row in _rows(name, chosen.quick):
                rows.append(row)
                say(f"    {row.what}: {row.ours}" + (f", {row.ratio:.3g} times" if row.ratio else ""))
    except KeyboardInterrupt:
        print(table(rows))
        say("interrupted; nothing was written")
        return 130
    print(table(rows))
    if not chosen.only and not chosen.quick:
        RESULTS.write_text(page(rows, time.perf_counter() - begun, busy), encoding="utf-8")
        say(f"wrote {RESULTS.name}")
    return 0


def _rows(name: str, quick: bool) -> Iterator[Row]:
    """The rows of one benchmark."""
    module = import_module(name)
    if name != "decode":
        yield from module.run(quick)
        return
    for row in module.run(100_000 if quick else 5_000_000):
        decoding = row["what"].startswith("decode")
        yield Row(
            row["what"], duration(row["ours_s"]), f"{'cantools' if decoding else 'python-can'}: {duration(row['other_s'])}",
            row["ratio"], "at least 10" if decoding else "", row["ratio"] >= 10 if decoding else None, row["note"],
        )  # fmt: skip


def table(rows: list[Row]) -> str:
    """The rows as Markdown."""
    lines = ["| what | ours | alternative | ratio | target | met | note |", "|---|---|---|---|---|---|---|"]
    for r in rows:
        ratio = f"{r.ratio:.3g}" if r.ratio is not None else ""
        met = {True: "yes", False: "**no**", None: ""}[r.met]
        lines.append(f"| {r.what} | {r.ours} | {r.other} | {ratio} | {r.target} | {met} | {r.note} |")
    return "\n".join(lines) + "\n"


def load() -> float:
    """How many programs run, on average of the last minute."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def page(rows: list[Row], seconds: float, busy: float) -> str:
    """RESULTS.md."""
    return f"""# Benchmarks

Written by `python benchmarks/run.py` on {date.today().isoformat()}, in one run of {seconds / 60:.0f} minutes on one
thread. Times are the best of several; in brackets, how much longer the longest took. A ratio is the alternative's time by
ours. A loop "alone" is timed on arrays that are there already, for us and for C.

{machine()}* other programs running: {busy:.1f} when it began; above about 0.5 the times are worth less

{table(rows)}
{LIMITS}"""


def machine() -> str:
    """Processor, system and versions."""
    import plain_c

    versions = []
    for name in LIBRARIES:
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            versions.append(f"{name} not installed")
    lines = [
        f"* processor: {_processor()}, {os.cpu_count()} cores",
        f"* system: {_system()}; {plain_c.version()}",
        f"* {platform.python_implementation()} {platform.python_version()}; {', '.join(versions)}",
    ]
    return "\n".join(lines) + "\n"


def _processor() -> str:
    """The model as the system tells it, and LLVM's name of its kind."""
    import llvmlite.binding as llvm

    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        found = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = found[0].split(":", 1)[1].strip() if found else model
    return f"{model} ({llvm.get_host_cpu_name()})"


def _system() -> str:
    try:
        name = platform.freedesktop_os_release()["PRETTY_NAME"]
    except OSError:
        name = platform.system()
    return f"{name}, {platform.system()} {platform.release().split('-')[0]}, {platform.machine()}"


if __name__ == "__main__":
    sys.exit(main())
