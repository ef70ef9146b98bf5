"""Figures of docs/trust.md: python docs/measure/trust.py [first seed] [last seed]; 20 drives take two minutes."""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np
from drives import drives, onto, rms, table

import codriver as cd
from codriver.simulate.demo import DURATION
from codriver.simulate.drive import drive
from codriver.simulate.judge import delay_matched
from codriver.simulate.road import demo_road
from codriver.simulate.sensors import SensorParameters, measured_log
from codriver.simulate.truth import truth_log

ELLS = (1.0, 2.0, 3.0)
AFTER = 1.0  # a shift counts from its start to this many seconds after its end
# Limits that tests/test_judge.py sets to the mean of three drives, in shifts intent-pedals over kinematic.
LIMITS = {("model", 1.0): 0.08, ("model", 2.0): 0.15, ("model", 3.0): 0.25, **{("plan", ell): 0.55 for ell in ELLS}}


def shifts(truth: cd.Log, time: np.ndarray) -> np.ndarray:
    """Where a gear shift goes on or was over less than AFTER seconds ago."""
    active = truth["shift"].values != 0
    stamps = truth["shift"].time[active]
    newest = np.searchsorted(stamps, time, side="right") - 1
    return (newest >= 0) & (time - stamps[np.maximum(newest, 0)] < AFTER)


def lead(estimate: np.ndarray, truth: np.ndarray, use: np.ndarray, dt: float) -> tuple[float, float]:
    """The best correlation over lags from 0 to 1.5 s, and the lag."""
    found = []
    for lag in range(0, round(1.5 / dt) + 1, 2):
        moved = np.roll(truth, lag)[use]
        found.append((float(np.corrcoef(estimate[use], moved)[0, 1]), lag * dt))
    return max(found)


def show(x: list[float]) -> str:
    """Mean and range."""
    return f"{np.mean(x):.3f} ({min(x):.3f}-{max(x):.3f})"


def noisy_pedals(seeds: range) -> None:
    """Intention and pedals-only with pedals of 1 % and 0.3 bar noise, against the plan: correlation and lag."""
    car = cd.load_vehicle("bisoffi2017")
    sensors, found = SensorParameters(pedal_noise=0.01, brake_noise=0.3e5), defaultdict(list)
    programs = {"pedals-only": cd.compile(cd.build("pedals-only", car))}
    programs |= {f"intent-pedals, ell {ell:g}": cd.compile(cd.build("intent-pedals", car, ell=ell)) for ell in ELLS}
    for seed in seeds:
        trace = drive(demo_road(), DURATION, seed=seed)
        log, truth = measured_log(trace, sensors, seed=seed), truth_log(trace)
        valid = programs["intent-pedals, ell 2"].run(log, start=0.0, stop=DURATION - 0.1).valid
        for name, program in programs.items():
            jerk = program.run(log, start=0.0, stop=DURATION - 0.1)["intentional_jerk"]
            found[name].append(
                (*lead(jerk.values, onto(truth, "planned_jerk", jerk.time), valid, 0.01), rms(jerk.values))
            )
    rows = [[name, *(f"{x:.2f}" for x in np.mean(f, axis=0))] for name, f in found.items()]
    print("\nwith noisy pedals")
    print(table(["estimator", "correlation with the plan", "at lag, s", "rms of the estimate, m/s^3"], rows))


def main(first: int = 11, last: int = 30) -> None:
    """Measure and print."""
    car = cd.load_vehicle("bisoffi2017")
    cover, error, ratio, follow = (defaultdict(list) for _ in range(4))
    programs = {ell: cd.compile(cd.build("intent-pedals", car, ell=ell)) for ell in ELLS}
    rivals = {ell: cd.compile(cd.build("kinematic", ell=ell)) for ell in ELLS}
    pedals = cd.compile(cd.build("pedals-only", car))
    for driven in drives(range(first, last + 1)):
        log, truth = driven.log, driven.truth
        for ell in ELLS:
            e = programs[ell].run(log)
            span = {"start": float(e.time[0]), "stop": float(e.time[-1])}
            k, p = rivals[ell].run(log, **span), pedals.run(log, **span)
            n = min(len(e.time), len(k.time), len(p.time))
            time, valid = e.time[:n], e.valid[:n]
            shift = shifts(truth, time) & valid
            jerks = {
                "intent-pedals": e.columns["intentional_jerk"][:n], "kinematic": k.columns["longitudinal_jerk"][:n],
                "pedals-only": p.columns["intentional_jerk"][:n], "zero": np.zeros(n),
            }  # fmt: skip
            for name in ("intentional_acceleration", "intentional_jerk"):
                off = np.abs(e.columns[name][:n] - onto(truth, name, time))
                cover[ell, name].append(float(np.mean(off[valid] <= 1.96 * e.sd(name)[:n][valid])))
            goals = {
                "moment": onto(truth, "intentional_jerk", time),
                "model": delay_matched(e, truth, "intentional_acceleration").columns["intentional_jerk"][:n],
                "plan": delay_matched(e, truth, "planned_acceleration").columns["intentional_jerk"][:n],
            }
            for goal, wanted in goals.items():
                for name, jerk in jerks.items():
                    error[ell, goal, name, ""].append(rms((jerk - wanted)[valid]))
                    error[ell, goal, name, "shift"].append(rms((jerk - wanted)[shift]))
                both = [rms((jerks[name] - wanted)[shift]) for name in ("intent-pedals", "kinematic")]
                ratio[ell, goal].append(both[0] / both[1])
            for name in ("intent-pedals", "kinematic", "pedals-only"):
                follow[ell, name].append(lead(jerks[name], onto(truth, "planned_jerk", time), valid, 0.01))
    print("coverage of the 95 % band, mean (range over drives)")
    names = ("intentional_acceleration", "intentional_jerk")
    print(table(["ell", *names], [[f"{ell:g}", *(show(cover[ell, name]) for name in names)] for ell in ELLS]))
    for goal in goals:
        for where in ("", "shift"):
            print(f"\nrms error of the jerk, m/s^3, against {goal} {where}")
            rows = []
            for ell in ELLS:
                rows.append([f"{ell:g}", *(f"{np.mean(error[ell, goal, n, where]):.3f}" for n in jerks)])
            print(table(["ell", *jerks], rows))
    print("\nin gear shifts, intent-pedals over kinematic")
    print(table(["ell", *goals], [[f"{ell:g}", *(show(ratio[ell, goal]) for goal in goals)] for ell in ELLS]))
    print("\nthe same against the limits")
    rows = []
    for (goal, ell), limit in LIMITS.items():
        found = np.array(ratio[ell, goal])
        rows.append(
            [goal, f"{ell:g}", f"{limit:g}", f"{found.mean():.3f}", f"{found.max():.3f}", str((found > limit).sum())]
        )
    print(table(["truth", "ell", "limit", "mean", "worst", f"above it of {len(found)}"], rows))
    print("\nin gear shifts: rms error of intent-pedals over that of always 0, against the plan")
    rows = []
    for ell in ELLS:
        ours, zero = (np.array(error[ell, "plan", name, "shift"]) for name in ("intent-pedals", "zero"))
        rows.append([f"{ell:g}", show(list(ours / zero)), str((ours > zero).sum())])
    print(table(["ell", "ratio", "drives above 1"], rows))
    print("\nbest correlation with the planned jerk, and its lag, s")
    rows = []
    for ell in ELLS:
        cells = []
        for name in ("intent-pedals", "kinematic", "pedals-only"):
            c, lag = np.mean(follow[ell, name], axis=0)
            cells.append(f"{c:.2f} at {lag:.2f}")
        rows.append([f"{ell:g}", *cells])
    print(table(["ell", "intent-pedals", "kinematic", "pedals-only"], rows))
    noisy_pedals(range(first, min(first + 5, last + 1)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
