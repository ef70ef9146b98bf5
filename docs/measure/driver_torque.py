"""The figures of docs/driver-torque.md: python docs/measure/driver_torque.py [rig | wheel | car]

rig     a simulator's wheel with friction of several sizes, six drivers' seeds that nothing was chosen on
wheel   what wrong coefficients cost
car     the Lincoln MKZ, map from two drives, judged on each drive left out (needs the recordings beside the project)
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import codriver as cd
from codriver.identify import identify_alignment
from codriver.measured_torque import compare_with_sensor
from codriver.observers.pi_weights import PIWeights
from codriver.offline import smooth
from codriver.run import estimate_log
from codriver.simulate.rig import RigDrive, RigSetting, simulate_rig
from codriver.simulate.steering import Wheel
from codriver.vehicles import Vehicle

SEEDS = (20, 21, 22, 23, 24, 25)
NAME = "driver-torque-logged"
INERTIA, DAMPING = 0.0298, 0.3515
RECORDINGS = Path(__file__).parents[3] / "shared" / "data" / "udacity-lincoln-mkz"
DRIVES = {"1": "hmb1-20hz.csv", "2": "hmb2-20hz.csv", "6": "hmb6-steering-50hz.csv"}
NAMES = Path(__file__).parents[2] / "tests" / "names" / "udacity.toml"


def wheel(friction: float, inertia: float = 1.0, damping: float = 1.0, told: float = 1.0) -> Vehicle:
    """The rig's wheel with errors: shares of the true coefficients."""
    car = Vehicle("rig", "rig", "simulated", {})
    car = car.with_parameter("steering_inertia", inertia * INERTIA, 0.01 * INERTIA)
    car = car.with_parameter("steering_damping", damping * DAMPING, 0.01 * DAMPING)
    return car.with_parameter("steering_friction", told * friction, 0.1 * told * friction)


def drives(friction: float) -> list[RigDrive]:
    """Two minutes by each driver, on a wheel with so much friction."""
    setting = replace(RigSetting(), wheel=Wheel(INERTIA, DAMPING, friction), seconds=120.0)
    return [simulate_rig(setting, seed=seed) for seed in SEEDS]


def judged(estimate: cd.Estimate, drive: RigDrive) -> tuple[float, float, float]:
    """Mean square error, share in the band and NEES, from 1 s on."""
    n = len(estimate.grid)
    use = estimate.valid & (estimate.time > 1.0)
    e = (estimate.columns["driver_torque"] - drive.driver_torque[:n])[use]
    sd = estimate.sd("driver_torque")
    if sd is None:
        return float(np.mean(e**2)), np.nan, np.nan
    return float(np.mean(e**2)), float(np.mean(np.abs(e) < 1.96 * sd[use])), float(np.mean((e / sd[use]) ** 2))


def told(rows: list[tuple[float, float, float]]) -> str:
    """RMSE, share in the band, NEES, over the seeds."""
    square, covered, nees = np.mean(rows, axis=0)
    return f"{np.sqrt(square):.3f}" + ("" if np.isnan(covered) else f", {covered:.0%}, {nees:.2f}")


def rig() -> None:
    """The filter, smoothers, the PI observer and the quasi-static answer, by friction."""
    print(
        "friction | filter: RMSE, in band, NEES | lag 0.2 s | hindsight | PI, paper's V | PI, best of 5 | T = -T_k | walks"
    )
    for friction in (0.0, 0.15, 0.3, 0.5):
        found: dict[str, list[tuple[float, float, float]]] = {}
        kinds = []
        for drive in drives(friction):
            log, car = drive.log(), wheel(friction)
            run = estimate_log(NAME, log, car)
            kinds.append(f"{run.provenance['order']}/{run.provenance['balance']}")
            found.setdefault("filter", []).append(judged(run, drive))
            found.setdefault("lag", []).append(judged(smooth(log, NAME, car, lag=0.2), drive))
            found.setdefault("smoother", []).append(judged(smooth(log, NAME, car), drive))
            for decade in (9, 10, 11, 12, 13):
                weights = PIWeights((1.0, 1.0, 10.0**decade), 1.0)
                pi_run = estimate_log("driver-torque-pi", log, car, preset=weights)
                found.setdefault(f"pi {decade}", []).append(judged(pi_run, drive))
            rest = (-drive.alignment_torque - drive.driver_torque)[drive.time > 1.0]
            found.setdefault("static", []).append((float(np.mean(rest**2)), np.nan, np.nan))
        best = min((k for k in found if k.startswith("pi")), key=lambda k: np.mean([r[0] for r in found[k]]))
        columns = [told(found[k]) for k in ("filter", "lag", "smoother", "pi 11", best, "static")]
        print(f"{friction:.2f} | " + " | ".join(columns) + f" | {' '.join(kinds)} (best V_33 1e{best[3:]})", flush=True)


def errors_of_the_wheel() -> None:
    """Wrong coefficients, at a friction of 0.3 N m."""
    friction = 0.3
    made = drives(friction)
    for what, shares in (
        ("right", (1, 1, 1)), ("J_s 10 % too large", (1.1, 1, 1)), ("b_s 10 % too large", (1, 1.1, 1)),
        ("T_c 30 % too small", (1, 1, 0.7)), ("T_c 30 % too large", (1, 1, 1.3)), ("no friction in the file", (1, 1, 0)),
    ):  # fmt: skip
        J, b, T = shares
        rows = [judged(estimate_log(NAME, d.log(), wheel(friction, J, b, T)), d) for d in made]
        print(f"{what} | {told(rows)}", flush=True)


def car() -> None:
    """Map from all drives but one, or from hmb1 and hmb2; the estimate against the sensor."""
    if not RECORDINGS.is_dir():
        sys.exit(f"{RECORDINGS} is not there")
    logs = {key: cd.read(RECORDINGS / file, names=NAMES) for key, file in DRIVES.items()}
    geometry = Vehicle("mkz", "Lincoln MKZ", "data sheet", {})
    for name, value in (("steering_ratio", 14.8), ("wheelbase", 2.85)):
        geometry = geometry.with_parameter(name, value)
    for learnt, out in (("12", "6"), ("1", "2"), ("2", "1"), ("16", "2"), ("26", "1")):
        fit = identify_alignment([logs[k] for k in learnt], geometry)
        vehicle = fit.vehicle(geometry, "mkz")
        run = estimate_log("driver-torque-car", logs[out], vehicle)
        found = compare_with_sensor(run)
        assert found is not None
        covered = "" if found.covered is None else f"{found.covered:.0%}"
        print(
            f"{','.join(learnt)} -> {out} | {found.rmse:.3f}, {found.r2:.2f} | {covered} | "
            f"{run.provenance['order']}/{run.provenance['balance']}", flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    chosen = sys.argv[1:] or ["rig", "wheel", "car"]
    for part in chosen:
        {"rig": rig, "wheel": errors_of_the_wheel, "car": car}[part]()
