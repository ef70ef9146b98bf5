"""Figures of docs/fused.md: python docs/measure/fused.py [drivers, default 6]; six drivers take about eight minutes.

The road test (42 minutes, with its bus) by each driver, at four levels of noise of pedal and brake. The constants of
intent-fused were chosen on other drives: seeds 101 to 110, on another road, by the drivers "ordinary" and "brisk".
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from drives import onto, rms, table

import codriver as cd
from codriver.observers import pedals_only
from codriver.program import Program
from codriver.simulate import PEDAL_NOISE_LEVELS as LEVELS
from codriver.simulate import STYLES, measured_log, road_test
from codriver.simulate.drive import Trace
from codriver.simulate.road_test import ROAD_TEST_SENSORS

ELLS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
CORNERS = (0.3, 0.5, 0.8, 1.2, 2.0, 4.0)  # f_D of pedals-only, Hz
FUSED = (0.5, 0.7, 1.0, 1.4, 2.0, 2.5, 3.0, 4.0, 6.0)
TRUTHS = {"plan": "planned_jerk", "model": "intentional_jerk"}
SEED = 1  # of the road test's first driver
IMAGE = Path(__file__).parent.parent / "images" / "fused.png"
Point = tuple[float, float]  # lag, s, and correlation


@dataclass(frozen=True, eq=False)
class Driven:
    """A driver's way, as its bus brought it at each level."""

    name: str
    trace: Trace
    truth: cd.Log
    logs: list[cd.Log]


def driven(name: str, seed: int) -> Driven:
    """Simulate one driver at every level."""
    tests = [road_test(name, seed, sensors=replace(ROAD_TEST_SENSORS, pedal_noise=p, brake_noise=b)) for p, b in LEVELS]
    return Driven(name, tests[0].trace, tests[0].truth, [test.log for test in tests])


def pedals_at(corner: float, car: cd.Vehicle) -> Program:
    """pedals-only with another corner frequency than the paper's."""
    usual, pedals_only.CORNER_FREQUENCY = pedals_only.CORNER_FREQUENCY, corner
    try:
        return cd.compile(cd.build("pedals-only", car))
    finally:
        pedals_only.CORNER_FREQUENCY = usual


def best(estimate: np.ndarray, truth: np.ndarray, use: np.ndarray, dt: float) -> Point:
    """The lag of the best correlation, over 0 to 2 s, and that correlation; on every fifth tick."""
    longest, found = round(2.0 / dt), []
    ticks = np.flatnonzero(use)[::5]
    ticks = ticks[ticks >= longest]
    for lag in range(0, longest + 1, 2):
        found.append((float(np.corrcoef(estimate[ticks], truth[ticks - lag])[0, 1]), lag * dt))
    correlation, lag_seconds = max(found)
    return lag_seconds, correlation


def jerk(program: Program, log: cd.Log, like: cd.Estimate) -> np.ndarray:
    """The jerk on the ticks of another estimate."""
    e = program.run(log, start=float(like.time[0]), stop=float(like.time[-1]))
    name = "longitudinal_jerk" if "longitudinal_jerk" in e else "intentional_jerk"
    return e.columns[name][: len(like.time)]


def curves(drives: list[Driven], families: dict[str, dict[float, Program]]) -> dict[tuple[int, str, str, float], Point]:
    """Lag and correlation, mean of the drives, by level, truth, estimator and its knob."""
    reference = families["intent-pedals"][2.0]
    found: dict[tuple[int, str, str, float], list[Point]] = defaultdict(list)
    for drive in drives:
        for level, log in enumerate(drive.logs):
            like = reference.run(log)
            for family, programs in families.items():
                for knob, program in programs.items():
                    estimate = jerk(program, log, like)
                    for truth, name in TRUTHS.items():
                        wanted = onto(drive.truth, name, like.time)
                        found[level, truth, family, knob].append(best(estimate, wanted, like.valid, like.grid.dt))
    return {key: (float(np.mean(p, axis=0)[0]), float(np.mean(p, axis=0)[1])) for key, p in found.items()}


def lead_over(points: list[Point], rival: list[Point]) -> tuple[float, float, int]:
    """The least lead in correlation at the lag of a rival's point, that lag, and how many points lie before the curve.

    An estimate that is there earlier can be held back, so the best of all earlier points counts; between points, straight.
    """
    ours = sorted(points)
    margins, quicker = [], 0
    for lag, correlation in rival:
        if lag < ours[0][0]:
            quicker += 1
            continue
        here = float(np.interp(lag, [p[0] for p in ours], [p[1] for p in ours]))
        earlier = max([here, *(p[1] for p in ours if p[0] <= lag)])
        margins.append((earlier - correlation, lag))
    return (*min(margins), quicker)


def moments(drives: list[Driven], programs: dict[str, Program]) -> None:
    """Errors against the truth of the moment, coverage of the bands, and what the noise adds."""
    rows = []
    for level, (pedal, brake) in enumerate(LEVELS):
        found = defaultdict(list)
        for drive in drives:
            log = drive.logs[level]
            like = programs["intent-pedals, ell 2"].run(log)
            wanted = onto(drive.truth, "intentional_jerk", like.time)
            found["zero"].append(rms(wanted[like.valid]))
            for name, program in programs.items():
                found[name].append(rms((jerk(program, log, like) - wanted)[like.valid]))
        sensors = replace(ROAD_TEST_SENSORS, pedal_noise=pedal, brake_noise=brake)
        logs = [measured_log(drives[0].trace, sensors, seed=seed) for seed in (11, 12)]
        for name, program in programs.items():
            a, b = (program.run(log, start=0.0, stop=1800.0) for log in logs)
            both = a.valid & b.valid
            off = (a.columns["intentional_jerk"] - b.columns["intentional_jerk"])[both]
            found[name].append(rms(off) / 2**0.5)
        label = f"{100 * pedal:g} %, {brake / 1e5:g} bar"
        for name, values in found.items():
            noise = "" if name == "zero" else f"{values[-1]:.3f}"
            rows.append([label, name, f"{np.mean(values[: len(drives)]):.3f}", noise])
    print(table(["pedal, brake", "estimator", "error of the moment", "noise"], rows))


def coverage(drives: list[Driven], programs: dict[float, Program]) -> None:
    """Share of the time in which the truth is in the 95 % band."""
    rows = []
    for level, (pedal, _) in enumerate(LEVELS):
        for ell, program in programs.items():
            found = defaultdict(list)
            for drive in drives:
                e = program.run(drive.logs[level])
                for name in ("intentional_acceleration", "intentional_jerk"):
                    off = np.abs(e.columns[name] - onto(drive.truth, name, e.time))
                    found[name].append(float(np.mean(off[e.valid] <= 1.96 * e.sd(name)[e.valid])))
            cells = (f"{100 * np.mean(f):.0f} ({100 * min(f):.0f}-{100 * max(f):.0f})" for f in found.values())
            rows.append([f"{100 * pedal:g} %", f"{ell:g}", *cells])
    print(table(["pedal noise", "ell", "acceleration, %", "jerk, %"], rows))


def in_shifts(drives: list[Driven], programs: dict[str, Program], kinematic: dict[str, Program], level: int) -> None:
    """Error in gear shifts and the second after, each at its own lag, over that of the kinematic model at its lag."""
    rows = []
    for name, program in programs.items():
        found = defaultdict(list)
        for drive in drives:
            log = drive.logs[level]
            like = program.run(log)
            stamps = drive.truth["shift"].time[drive.truth["shift"].values != 0]
            newest = np.searchsorted(stamps, like.time, side="right") - 1
            shift = (newest >= 0) & (like.time - stamps[np.maximum(newest, 0)] < 1.0) & like.valid
            other = jerk(kinematic[name], log, like)
            for truth, signal in TRUTHS.items():
                wanted = onto(drive.truth, signal, like.time)
                own = best(like.columns["intentional_jerk"], wanted, like.valid, like.grid.dt)[0]
                its = best(other, onto(drive.truth, "longitudinal_jerk", like.time), like.valid, like.grid.dt)[0]
                errors = [
                    rms((estimate - np.roll(wanted, round(lag / like.grid.dt)))[shift])
                    for estimate, lag in ((like.columns["intentional_jerk"], own), (other, its))
                ]
                zero = rms(wanted[shift])
                found[truth].append((errors[0], zero, errors[0] / errors[1]))
        for truth, values in found.items():
            ours, zero, ratio = np.mean(values, axis=0)
            rows.append([name, truth, f"{ours:.2f}", f"{zero:.2f}", f"{ratio:.2f}"])
    print(table(["estimator", "truth", "error", "always 0", "over kinematic"], rows))


def wrong(drives: list[Driven], car: cd.Vehicle, level: int) -> None:
    """With parameters that are off by 10 %."""
    rows = []
    cases = {"nothing": car}
    for name, letter in (("pedal_coefficient", "c_r"), ("mass", "M"), ("brake_coefficient", "c_b")):
        cases[f"{letter} +10 %"] = car.with_parameter(name, 1.1 * car.number(name))
    reference = cd.compile(cd.build("intent-pedals", car))
    for said, vehicle in cases.items():
        for name in ("intent-fused", "intent-pedals"):
            program, found, acceleration = cd.compile(cd.build(name, vehicle)), defaultdict(list), []
            for drive in drives:
                log = drive.logs[level]
                like = reference.run(log)
                e = program.run(log, start=float(like.time[0]), stop=float(like.time[-1]))
                for truth, signal in TRUTHS.items():
                    wanted = onto(drive.truth, signal, like.time)
                    found[truth].append(best(e.columns["intentional_jerk"], wanted, like.valid, like.grid.dt))
                off = e.columns["intentional_acceleration"] - onto(drive.truth, "intentional_acceleration", like.time)
                acceleration.append(rms(off[like.valid]))
            cells = [f"{np.mean(p, axis=0)[1]:.3f} at {np.mean(p, axis=0)[0]:.2f} s" for p in found.values()]
            rows.append([said, name, *cells, f"{np.mean(acceleration):.2f}"])
    print(table(["wrong", "estimator", *TRUTHS, "error of the acceleration, m/s^2"], rows))


def draw(points: dict[tuple[int, str, str, float], Point], path: Path) -> None:
    """The curves, four levels by two truths."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    style = {"intent-fused": ("tab:red", "o"), "intent-pedals": ("tab:blue", "s"), "pedals-only": ("tab:green", "^")}
    figure, axes = plt.subplots(2, 4, figsize=(12, 5.6), sharex="row", sharey="row", layout="constrained")
    for row, truth in enumerate(TRUTHS):
        for level, (pedal, brake) in enumerate(LEVELS):
            ax = axes[row, level]
            for family, (colour, marker) in style.items():
                found = [(k[3], p) for k, p in points.items() if k[:3] == (level, truth, family)]
                line = np.array([p for _, p in sorted(found)])
                ax.plot(line[:, 0], line[:, 1], color=colour, marker=marker, ms=4, lw=1.4, label=family)
                for knob, (lag, correlation) in found:
                    if (family, knob) in (("intent-fused", 2.0), ("intent-pedals", 2.0), ("pedals-only", 2.0)):
                        ax.plot(lag, correlation, color=colour, marker=marker, ms=9, mfc="none", ls="")
            ax.set_xlim(0, 1.5)
            ax.set_ylim(0.5, 1.0)
            ax.grid(alpha=0.3)
            if row == 0:
                ax.set_title(f"pedal {100 * pedal:g} %, brake {brake / 1e5:g} bar", fontsize=10)
            else:
                ax.set_xlabel("lag of the best correlation, s")
        axes[row, 0].set_ylabel(f"correlation with the {'plan' if truth == 'plan' else 'model'}'s jerk")
    axes[0, 0].legend(fontsize=8, loc="lower right")
    figure.savefig(path, dpi=80)


def main(count: int = 6) -> None:
    """Measure and print."""
    car = cd.load_vehicle("bisoffi2017")
    drives = [driven(name, SEED + k) for k, name in enumerate(list(STYLES)[:count])]
    families = {
        "intent-fused": {ell: cd.compile(cd.build("intent-fused", car, ell=ell)) for ell in FUSED},
        "intent-pedals": {ell: cd.compile(cd.build("intent-pedals", car, ell=ell)) for ell in ELLS},
        "pedals-only": {corner: pedals_at(corner, car) for corner in CORNERS},
    }
    points = curves(drives, families)
    rows = []
    for truth in TRUTHS:
        for level, (pedal, _) in enumerate(LEVELS):
            for family, programs in families.items():
                cells = []
                for knob in programs:
                    lag, correlation = points[level, truth, family, knob]
                    cells.append(f"{knob:g}: {correlation:.3f} at {lag:.2f}")
                rows.append([truth, f"{100 * pedal:g} %", family, ", ".join(cells)])
    print(table(["truth", "pedal noise", "estimator", "knob: correlation at lag, s"], rows))
    print("\nleast lead of intent-fused over a point of the others")
    rows = []
    for truth in TRUTHS:
        for level, (pedal, _) in enumerate(LEVELS):
            ours = [points[level, truth, "intent-fused", knob] for knob in FUSED]
            for rival in ("intent-pedals", "pedals-only"):
                theirs = [points[level, truth, rival, knob] for knob in families[rival]]
                lead, lag, quicker = lead_over(ours, theirs)
                rows.append([truth, f"{100 * pedal:g} %", rival, f"{lead:+.3f}", f"{lag:.2f}", str(quicker)])
    print(table(["truth", "pedal noise", "rival", "least lead", "at lag, s", "quicker than any of ours"], rows))
    draw(points, IMAGE)
    some = {f"intent-pedals, ell {ell:g}": families["intent-pedals"][ell] for ell in (1.0, 2.0, 3.0)}
    chosen = {"intent-fused, ell 2": families["intent-fused"][2.0], **some}
    print("\nerror against the model's jerk of the moment, and what noise adds, m/s^3")
    moments(drives, {**chosen, "pedals-only, 2 Hz": families["pedals-only"][2.0]})
    print("\ncoverage of the 95 % band, mean (range over drives)")
    coverage(drives, {ell: families["intent-fused"][ell] for ell in (1.0, 1.4, 2.0, 3.0)})
    kinematic = {ell: cd.compile(cd.build("kinematic", ell=ell)) for ell in (1.0, 2.0, 3.0)}
    compared = {name: kinematic[float(name.split()[-1])] for name in chosen}
    for level in (0, 2):
        print(f"\nin gear shifts, pedal noise {100 * LEVELS[level][0]:g} %, m/s^3")
        in_shifts(drives, chosen, compared, level)
        print("\nwrong parameters, same noise")
        wrong(drives, car, level)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
