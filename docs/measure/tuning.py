"""Figures of docs/tuning.md: python docs/measure/tuning.py; some two minutes.

Tuned on a quarter of an hour of the road test by each of three drivers, judged on a quarter of an hour by the same drivers with
another seed. And the curve of delay against noise: computed, and measured on the demo drive with and without sensor noise.
"""

# ruff: noqa: T201
from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from time import perf_counter

import numpy as np
from drives import onto, rms, table
from smoothing import follow

import codriver as cd
from codriver.observers import PRESETS, Preset
from codriver.simulate import SensorParameters, demo_drive, measured_log, road_test
from codriver.simulate.judge import delay_matched
from codriver.tune import ell_for_delay, tune
from codriver.tune.curve import point

STYLES = ("ordinary", "aggressive", "smooth")
SECONDS = 900.0
PAPER = PRESETS["bisoffi2017"]
CLEAN = {"acceleration_noise": 0.0, "acceleration_step": 1e-9, "speed_noise": 0.0, "speed_step": 1e-9}


def judged(preset: Preset, ell: float, tests: list, car: cd.Vehicle) -> list[float]:
    """Means over drives: error against the moment's model, against the delay-matched model and plan; correlation, lag."""
    rows = []
    for test in tests:
        e = cd.estimate_log("intent-pedals", test.log, car, ell=ell, preset=preset)
        jerk, valid, dt = e.columns["intentional_jerk"], e.valid, e.grid.dt
        errors = [rms((jerk - onto(test.truth, "intentional_jerk", e.time))[valid])]
        for wanted in ("intentional_acceleration", "planned_acceleration"):
            errors.append(rms((jerk - delay_matched(e, test.truth, wanted).columns["intentional_jerk"])[valid]))
        rows.append([*errors, *follow(jerk, onto(test.truth, "planned_jerk", e.time), valid, dt)])
    return [float(x) for x in np.mean(rows, axis=0)]


def likelihood() -> None:
    """What maximum likelihood chooses, and what that is worth."""
    car = cd.load_vehicle("bisoffi2017")
    one, other = ([road_test(style, seed, duration=SECONDS) for style in STYLES] for seed in (1, 2))
    begun = perf_counter()
    found = tune([test.log for test in one], "intent-pedals", car)
    took, fit = perf_counter() - begun, found.noise
    assert fit is not None
    minutes = SECONDS * len(one) / 60
    print(
        f"tuned on {minutes:.0f} minutes in {took:.1f} s, {found.seconds / 60:.0f} of them count, sensors {found.sensors}"
    )
    print(f"log likelihood {fit.start.log_likelihood:.0f} -> {fit.found.log_likelihood:.0f}, {fit.found.count} rows")
    print(f"converged {fit.converged}, {fit.evaluations} evaluations")
    told = [[r.name, f"{r.start:.3g}", f"{r.found:.3g}", f"{np.exp(r.spread):.2f}", str(r.told)] for r in fit.ratios]
    print(table(["over R of the accelerometer", "begun with", "found", "times or over", "told"], told))
    print(f"most likely ell of bisoffi2017: {found.profile.best:.3g}, times or over {np.exp(found.profile.spread):.3f}")
    for a, b in zip(found.before, found.after, strict=True):
        print(f"{a.row}: correlation of neighbouring innovations {a.correlation[0]:.2f} -> {b.correlation[0]:.2f}")
    each = []
    for test, style in zip(one, STYLES, strict=True):
        alone = tune([test.log], "intent-pedals", car)
        each.append([style, f"{alone.profile.best:.2f}", f"{alone.chosen.slow_delay:.2f}"])
    print(table(["tuned on one driver alone", "most likely ell", "delay of fitted Q, R, s"], each))
    own, rows = found.preset, []
    settings = [("bisoffi2017", PAPER, found.profile.best), ("fitted", own, own.ell)]
    for wanted in (0.911, 0.456, 0.304, 0.2):
        settings += [("bisoffi2017", PAPER, ell_for_delay(PAPER, wanted)), ("fitted", own, ell_for_delay(own, wanted))]
    for name, preset, ell in settings:
        p = point(preset, ell, found.dt, found.every, found.sensors)
        m, dm, dp, c, lag = judged(preset, ell, other, car)
        rows.append(
            [
                name,
                f"{ell:.2f}",
                f"{p.slow_delay:.2f}",
                f"{p.noise:.3f}",
                f"{m:.3f}",
                f"{dm:.3f}",
                f"{dp:.3f}",
                f"{c:.3f} at {lag:.2f}",
            ]
        )
    zero = np.mean([rms(test.truth["intentional_jerk"].values) for test in other])
    print(
        table(
            [
                "noise",
                "ell",
                "delay",
                "jerk noise",
                "moment",
                "lag out, model",
                "lag out, plan",
                "correlation with the plan",
            ],
            rows,
        )
    )
    print(f"always 0 against the moment's model: {zero:.3f}")


def curve(seeds: range = range(1, 6)) -> None:
    """Computed and measured: noise against the run without, delay by correlation with the truth."""
    car, found = cd.load_vehicle("bisoffi2017"), defaultdict(list)
    ells = (0.7, 1.0, 1.4, 2.0, 3.0, 4.0)
    for seed in seeds:
        demo, sensors = demo_drive(seed), SensorParameters()
        logs = [measured_log(demo.trace, s, seed=seed) for s in (sensors, replace(sensors, **CLEAN))]
        for ell in ells:
            noisy, clean = (cd.estimate_log("intent-pedals", log, car, ell=ell) for log in logs)
            jerk, valid = noisy.columns["intentional_jerk"], noisy.valid
            noise = rms((jerk - clean.columns["intentional_jerk"])[valid])
            best = follow(
                clean.columns["intentional_jerk"], onto(demo.truth, "intentional_jerk", noisy.time), valid, 0.01
            )
            found[ell].append([noise, best[1]])
    sd = (float(np.hypot(0.06, 0.01 / 12**0.5)), float(np.hypot(0.012, 0.01 / 12**0.5) / 2**0.5))
    rows = []
    for ell in ells:
        p, (noise, lag) = point(PAPER, ell, 0.01, (1, 2), sd), np.mean(found[ell], axis=0)
        rows.append(
            [
                f"{ell:g}",
                f"{p.slow_delay:.2f}",
                f"{p.delay:.2f}",
                f"{lag:.2f}",
                f"{p.noise:.4f}",
                f"{noise:.4f}",
                f"{noise / p.noise:.2f}",
            ]
        )
    print(
        table(
            ["ell", "delay, every tick", "at these rates", "by correlation", "noise computed", "measured", "ratio"],
            rows,
        )
    )


if __name__ == "__main__":
    curve()
    likelihood()
