"""Figures of docs/smoothing.md: python docs/measure/smoothing.py [driver ...]; three drivers take two minutes.

The whole road test, each driver once. Errors against the truth of the moment, with no lag taken out, on the ticks where the
filter at ell = 1 is valid; coverage where each is valid itself.
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections import defaultdict
from time import perf_counter

import numpy as np
from drives import onto, rms, table

import codriver as cd
from codriver.offline import smooth
from codriver.simulate import road_test

ELLS = (1.0, 2.0, 3.0)
MORE_ELLS = (1.5, 4.0, 6.0, 8.0)
LAGS = (0.2, 0.5, 1.0, 2.0)
FURTHEST = 1.5  # s, of the lag with the best correlation


def follow(estimate: np.ndarray, truth: np.ndarray, use: np.ndarray, dt: float) -> tuple[float, float]:
    """The best correlation over lags from -0.5 to 1.5 s, and the lag."""
    found = []
    for lag in range(-round(0.5 / dt), round(FURTHEST / dt) + 1, 2):
        moved = np.roll(truth, lag)[use]
        found.append((float(np.corrcoef(estimate[use], moved)[0, 1]), lag * dt))
    return max(found)


def main(*styles: str) -> None:
    """Measure and print."""
    car = cd.load_vehicle("bisoffi2017")
    found: dict[str, list[list[float]]] = defaultdict(list)
    took = []
    for style in styles or ("ordinary", "aggressive", "smooth"):
        test = road_test(style)
        log, truth = test.log, test.truth
        first = cd.estimate_log("intent-pedals", log, car, ell=1.0)
        time, use, dt = first.time, first.valid, first.grid.dt
        model, plan = (onto(truth, name, time) for name in ("intentional_jerk", "planned_jerk"))
        wanted = onto(truth, "intentional_acceleration", time)
        runs = {f"filter, ell {ell:g}": cd.estimate_log("intent-pedals", log, car, ell=ell) for ell in ELLS}
        for ell in sorted((*ELLS, *MORE_ELLS)):
            begun = perf_counter()
            runs[f"smoother, ell {ell:g}"] = smooth(log, "intent-pedals", car, ell=ell)
            took.append(perf_counter() - begun)
        for ell in (2.0, 3.0):
            for lag in LAGS:
                runs[f"fixed lag {lag:g} s, ell {ell:g}"] = smooth(log, "intent-pedals", car, ell=ell, lag=lag)
        pedals = cd.compile(cd.build("pedals-only", car, dt=dt)).run(log, start=float(time[0]), stop=float(time[-1]))
        runs["pedals-only"] = pedals
        for name, run in runs.items():
            n = min(len(run.grid), time.size)
            jerk, here = run.columns["intentional_jerk"][:n], use[:n]
            sd, sd_a = run.sd("intentional_jerk"), run.sd("intentional_acceleration")
            own = run.valid[:n]
            inside = [float("nan")] * 2
            if sd is not None and sd_a is not None:
                off = np.abs(run.columns["intentional_acceleration"][:n] - wanted[:n])
                inside = [
                    float(np.mean(np.abs(jerk - model[:n])[own] <= 1.96 * sd[:n][own])),
                    float(np.mean(off[own] <= 1.96 * sd_a[:n][own])),
                ]
            best = follow(jerk, plan[:n], here, dt)
            found[name].append(
                [rms((jerk - model[:n])[here]), rms((jerk - plan[:n])[here]), *best, *inside, float(own.mean())]
            )
        found["always 0"].append([rms(model[use]), rms(plan[use]), *[float("nan")] * 4, 1.0])
    rows = []
    for name, each in found.items():
        m, p, c, lag, j, a, valid = np.mean(each, axis=0)
        said = [f"{m:.3f}", f"{p:.3f}", f"{c:.3f} at {lag:.2f}" if np.isfinite(c) else ""]
        said += [f"{x:.1%}" if np.isfinite(x) else "" for x in (j, a, valid)]
        rows.append([name, *said])
    head = [
        "",
        "error, model",
        "error, plan",
        "correlation with the plan, at lag s",
        "jerk in band",
        "acceleration in band",
        "valid",
    ]
    print(table(head, rows))
    minutes = len(time) * dt / 60
    print(
        f"\none smoothing of a drive of {minutes:.0f} minutes: {min(took):.2f} to {max(took):.2f} s, reading left out"
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
