"""What an error of 5 % in a parameter does (docs/estimators.md), and what check() makes of a mass that is wrong by a factor
(docs/trust.md). python docs/measure/sensitivity.py"""

# ruff: noqa: T201
from __future__ import annotations

import numpy as np
from drives import Driven, drives, rms, table

import codriver as cd
from codriver.simulate.judge import delay_matched

SEEDS = range(11, 16)
CHANGES = {
    "intent-pedals": ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
    "intent-torque": ("mass", "transmission"),
    "pedals-only": ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
}


def changed(car: cd.Vehicle, parameter: str) -> cd.Vehicle:
    """The car with one parameter 5 % too large."""
    values = car.numbers(parameter)
    return car.with_parameter(parameter, tuple(1.05 * v for v in values) if len(values) > 1 else 1.05 * values[0])


def ideal_jerk(driven: Driven, estimate: cd.Estimate) -> np.ndarray:
    """The delay-matched reference: the intention as the model defines it."""
    return delay_matched(estimate, driven.truth, "intentional_acceleration").columns["intentional_jerk"]


def wrong_mass(car: cd.Vehicle, logs: list[Driven]) -> None:
    """What check() says of a wrong mass, and what it costs: error of the jerk, band, findings that the right mass has not."""
    right = [cd.compile(cd.build("intent-pedals", car)).run(d.log) for d in logs]
    ideal = [ideal_jerk(d, e) for d, e in zip(logs, right, strict=True)]
    rows = []
    for factor in (1.0, 0.25, 0.5, 2.0, 4.0):
        program = cd.compile(cd.build("intent-pedals", car.with_parameter("mass", factor * car.number("mass"))))
        figures, added, drives_with, bad = [], 0, 0, 0
        for d, e, i in zip(logs, right, ideal, strict=True):
            other = program.run(d.log)
            check = other.check()
            more = sum(f.severity != "ok" for f in check.findings) - sum(f.severity != "ok" for f in e.check().findings)
            added, drives_with, bad = added + more, drives_with + (more > 0), bad + (not check.trusted)
            off = rms((other.columns["intentional_jerk"] - i)[e.valid])
            larger = max(check.nis[row] ** 0.5 for row in check.nis), max(check.lean[row] ** 0.5 for row in check.lean)
            figures.append([off, float(other.sd("intentional_jerk")[e.valid].mean()), *larger])
        means = [f"{x:.3f}" for x in np.mean(figures, axis=0)]
        rows.append([f"{factor:g}", *means, f"{added} in {drives_with} of {len(logs)} drives", str(bad)])
    print("\n`intent-pedals` with a wrong mass")
    print(
        table(
            ["mass times", "jerk error, m/s^3", "mean sd of the jerk", "scatter", "lean", "more warnings", "bad"], rows
        )
    )


def main() -> None:
    """Measure and print."""
    car = cd.load_vehicle("bisoffi2017")
    logs = list(drives(SEEDS))
    rows = []
    for name, parameters in CHANGES.items():
        right = [cd.compile(cd.build(name, car)).run(d.log) for d in logs]
        ideal = [ideal_jerk(d, e) if name != "pedals-only" else None for d, e in zip(logs, right, strict=True)]
        error = [
            rms((e["intentional_jerk"].values - i)[e.valid]) for e, i in zip(right, ideal, strict=True) if i is not None
        ]
        rows.append([name, "none", "0", f"{np.mean(error):.4f}" if error else "-"])
        for parameter in parameters:
            program = cd.compile(cd.build(name, changed(car, parameter)))
            share, error = [], []
            for d, e, i in zip(logs, right, ideal, strict=True):
                other = program.run(d.log)
                a, b = (x.columns["intentional_jerk"][e.valid] for x in (e, other))
                share.append(rms(a - b) / rms(a))
                if i is not None:
                    error.append(rms(b - i[e.valid]))
            rows.append(
                [name, f"{parameter} +5 %", f"{100 * np.mean(share):.2f} %", f"{np.mean(error):.4f}" if error else "-"]
            )
    print(
        table(
            ["estimator", "wrong", "change of the jerk, rms over rms", "error against the model's truth, m/s^3"], rows
        )
    )
    wrong_mass(car, logs)


if __name__ == "__main__":
    main()
