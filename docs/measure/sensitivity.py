"""Figures of docs/estimators.md: what an error of 5 % in a parameter does. python docs/measure/sensitivity.py"""

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


if __name__ == "__main__":
    main()
