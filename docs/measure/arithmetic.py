"""Figures of docs/bit-contract.md and docs/c-export.md: operations, compile times, error of the float export.

python docs/measure/arithmetic.py            needs gcc for the float errors
"""

# ruff: noqa: T201
from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path
from time import perf_counter

from drives import table

import codriver as cd
from codriver.export import export_c
from codriver.kernel.llvm import compile_loop
from codriver.observers import ESTIMATORS

CAR = cd.load_vehicle("bisoffi2017")
CASES = [
    (name, form)
    for name in ESTIMATORS
    for form in ("kalman", "constant")
    if (name, form) != ("pedals-only", "constant")
]
JERK = {name: "longitudinal_jerk" if name == "kinematic" else "intentional_jerk" for name in ESTIMATORS}


def best(work: object, times: int = 3) -> float:
    """Shortest of some runs, s."""
    found = []
    for _ in range(times):
        start = perf_counter()
        work()
        found.append(perf_counter() - start)
    return min(found)


def float_error(program: cd.Program) -> str:
    """The worst error that the exported check program prints, relative to max(1, |value|)."""
    if shutil.which("gcc") is None:
        return "no gcc"
    with tempfile.TemporaryDirectory() as folder:
        export_c(program, folder, "float")
        flags = ["-std=c99", "-O2", "-ffp-contract=off"]
        sources = [str(path) for path in Path(folder).glob("*.c")]
        subprocess.run(["gcc", *flags, *sources, "-o", f"{folder}/check", "-lm"], check=True)
        said = subprocess.run([f"{folder}/check"], capture_output=True, text=True).stdout
        return said.strip().splitlines()[-1].rsplit(" ", 1)[-1]


def main() -> None:
    """Measure and print."""
    cd.compile(cd.build("kinematic"))  # wakes CasADi and LLVM once
    rows = []
    for name, form in CASES:
        observer = cd.build(name, CAR, form=form)
        program, jerk = cd.compile(observer), cd.compile(observer, [JERK[name], "valid"])
        record = best(lambda observer=observer: observer.record())
        translate = best(lambda program=program: compile_loop(program.recorded, anew=True))
        state = len(program.recorded.carry)
        rows.append([
            name, form, str(program.recorded.operations()), str(jerk.recorded.operations()), str(state),
            f"{1e3 * record:.0f}", f"{1e3 * translate:.0f}", float_error(program),
        ])  # fmt: skip
    head = ["estimator", "form", "operations", "jerk and valid only", "carried scalars"]
    head += ["record, ms", "LLVM, ms", "float error"]
    print(table(head, rows))
    rows = []
    for dt in (0.001, 0.005, 0.01, 0.05):
        for ell in (1.0, 3.0):
            knobs = {n: ell if e.knob else None for n, e in ESTIMATORS.items()}
            errors = [float_error(cd.compile(cd.build(n, CAR, dt=dt, ell=knobs[n], form=f))) for n, f in CASES]
            rows.append([f"{dt:g}", f"{ell:g}", *errors])
    print("\nfloat error by tick and ell\n" + table(["dt, s", "ell", *(f"{n}, {f}" for n, f in CASES)], rows))


if __name__ == "__main__":
    main()
