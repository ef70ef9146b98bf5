"""Figures of docs/hands.md: python docs/measure/hands.py [DRIVES]      10 min each; 12 drives a row by default

python docs/measure/hands.py fit          finds the defaults of HandsSettings again, on drives of other seeds; some minutes
python docs/measure/hands.py recorded FOLDER     the two recorded columns, with comma2k19-rav4 and iracing in FOLDER
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

import numpy as np
from drives import table
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.special import expit

import codriver as cd
from codriver.observers.column import logged_column
from codriver.observers.driver_torque import driver_torque_observer
from codriver.observers.hands import HandsSettings, hands_observer
from codriver.observers.torque_noise import TorqueNoise
from codriver.simulate.hands import HandsSetting, simulate_hands
from codriver.simulate.judge_hands import HandsJudged, judge_hands

DT = 0.01
WALKS = (1.0, 3.0, 8.0)  # N m per sqrt(s), of the torque observer
FITTED = ("share", "floor", "pulling_torque", "correlation", "quiet_dwell", "pulling_dwell", "pulling_first")


@dataclass(frozen=True, eq=False)
class Estimated:
    """Estimated torque of some drives, its band and its flag, and whether hands were on, shape (drives, n) each."""

    torque: np.ndarray
    band: np.ndarray
    valid: np.ndarray
    on: np.ndarray

    def hands(self, settings: HandsSettings) -> np.ndarray:
        """Probability of hands on."""
        program = cd.compile(hands_observer(DT, settings))
        n = self.torque.shape[1]
        found = []
        for columns in zip(self.torque, self.band, self.valid, strict=True):
            values = dict(zip(("driver_torque", "driver_torque_sd", "valid"), columns, strict=True))
            ok = dict.fromkeys(values, np.ones(n, bool))
            found.append(program.run_grid(cd.Grid(np.arange(n) * DT, DT, values, ok, ok))["hands_on"])
        return np.array(found)


def estimated(seed: int, drives: int, walk: float, setting: HandsSetting | None = None) -> Estimated:
    """Simulate and estimate the torque."""
    setting = setting or HandsSetting()
    made, car = simulate_hands(setting, drives=drives, seed=seed), setting.vehicle()
    noise = TorqueNoise(order=1, angle=5e-4, slip=0.0, rate=0.0, torque=walk)
    program = cd.compile(driver_torque_observer(car, logged_column(car, DT), noise, DT))
    runs = [program.run(made.log(drive)).columns for drive in range(drives)]
    columns = (np.array([run[name] for run in runs]) for name in ("driver_torque", "driver_torque_sd", "valid"))
    return Estimated(*columns, made.hands_on)


def loss(p: np.ndarray, on: np.ndarray) -> float:
    """Log loss."""
    return judge_hands(p, on, DT).log_loss


def fit(names: tuple[str, ...] = FITTED, start: HandsSettings | None = None, evaluations: int = 170) -> HandsSettings:
    """The settings of least log loss over three torque observers, by Nelder and Mead on their logarithms."""
    start = start or HandsSettings()
    sets = [estimated(100 + k, 5, walk) for k, walk in enumerate(WALKS)]

    def settings(x: np.ndarray) -> HandsSettings:
        found = dict(zip(names, np.exp(x).tolist(), strict=True))
        if "pulling_first" in found:
            found["pulling_first"] = min(found["pulling_first"], 1.0)
        return replace(start, **found)

    x = np.log([getattr(start, name) for name in names])
    simplex = np.vstack([x, x + 0.3 * np.eye(x.size)])
    options = {"maxfev": evaluations, "initial_simplex": simplex}
    found = minimize(
        lambda x: np.mean([loss(s.hands(settings(x)), s.on) for s in sets]), x, method="Nelder-Mead", options=options
    )
    print(f"log loss {found.fun:.4f}: {settings(found.x)}", flush=True)
    return settings(found.x)


def two_states() -> HandsSettings:
    """The filter without the state of quiet hands, fitted alike."""
    start = HandsSettings(
        pulling_dwell=inf, pulling_first=1.0, share=0.28, floor=0.1, pulling_torque=0.24, correlation=0.5
    )
    return fit(("share", "floor", "pulling_torque", "correlation"), start, 70)


def baselines(walk: float) -> dict[str, Callable[[Estimated], np.ndarray]]:
    """What is simplest, fitted on drives of other seeds: a probability by the estimated torque."""
    known = estimated(100, 5, walk)
    long_run = known.on.mean()
    thresholds = np.geomspace(0.05, 3, 40)

    def by_threshold(limit: float) -> Callable[[Estimated], np.ndarray]:
        beyond = abs(known.torque) > limit
        if beyond.all() or not beyond.any():
            return lambda e: np.full(e.on.shape, known.on.mean())
        high, low = known.on[beyond].mean(), known.on[~beyond].mean()
        return lambda e: np.where(abs(e.torque) > limit, high, low)

    best = min(thresholds, key=lambda limit: loss(by_threshold(limit)(known), known.on))

    def level(e: Estimated, over: float) -> np.ndarray:
        keep = np.exp(-DT / over)
        return np.log(lfilter([1 - keep], [1, -keep], abs(e.torque), axis=-1) + 1e-3)

    def logistic(over: float) -> tuple[float, Callable[[Estimated], np.ndarray]]:
        x, on = level(known, over), known.on
        thin = (slice(None), slice(None, None, 10))
        found = minimize(lambda c: loss(expit(c[0] + c[1] * x[thin] + c[2] * x[thin] ** 2), on[thin]), [0.0, 1.0, 0.0])
        c = found.x

        def by(e: Estimated) -> np.ndarray:
            return expit(c[0] + c[1] * level(e, over) + c[2] * level(e, over) ** 2)

        return float(found.fun), by

    return {
        "long-run share": lambda e: np.full(e.on.shape, long_run),
        "threshold": by_threshold(best),
        "logistic": min((logistic(over) for over in (0.5, 1.0, 2.0, 4.0)), key=lambda pair: pair[0])[1],
    }


def row(name: str, judged: HandsJudged) -> list[str]:
    """A row of the comparison."""
    delays = [
        f"{d:.1f} ({100 * m:.0f} %)"
        for d, m in ((judged.on_delay, judged.on_missed), (judged.off_delay, judged.off_missed))
    ]
    scores = [f"{x:.3f}" for x in (judged.log_loss, judged.brier, judged.calibration_error)]
    return [name, *scores, *delays, f"{judged.false_alarms:.0f}"]


def main(drives: int) -> None:
    """Reliability, comparison, and what happens when car and driver are others."""
    head = [
        "way",
        "log loss",
        "Brier",
        "calibration error",
        "on told after, s (missed)",
        "off told after, s (missed)",
        "false alarms an hour",
    ]
    two = two_states()
    for walk in WALKS:
        seen = estimated(500, drives, walk)
        rows = [row(name, judge_hands(by(seen), seen.on, DT)) for name, by in baselines(walk).items()]
        rows += [row("two states", judge_hands(seen.hands(two), seen.on, DT))]
        full = judge_hands(seen.hands(HandsSettings()), seen.on, DT)
        print(f"\ntorque noise {walk:g} N m per sqrt(s)\n\n" + table(head, [*rows, row("hands", full)]), flush=True)
        if walk == WALKS[1]:
            bins = [
                [f"{b.low:.1f} to {b.high:.1f}", *(f"{x:.3f}" for x in (b.share, b.said, b.found))] for b in full.bins
            ]
            print("\n" + table(["p", "share of time", "mean p", "hands on"], bins), flush=True)
    base = HandsSetting()
    others = {
        "as fitted": base, "a smooth driver, 0.05 N m": replace(base, unsteadiness=0.05),
        "a rough driver, 0.4 N m": replace(base, unsteadiness=0.4),
        "hands mostly resting": replace(base, resting_dwell=20.0, steering_dwell=4.0),
        "hands off for minutes": replace(base, off_dwell=120.0, on_dwell=60.0),
        "tyre torque wrong by 0.15 N m, 15 %": replace(base, wander=0.15, factor_error=0.15),
        "friction 0.4 N m": replace(base, wheel=replace(base.wheel, friction=0.4)),
    }  # fmt: skip
    rows = []
    for name, setting in others.items():
        seen = estimated(600, drives, WALKS[1], setting)
        share = loss(np.full(seen.on.shape, seen.on.mean()), seen.on)
        ways = {name: HandsSettings()}
        if name == "hands mostly resting":
            ways["the same, quiet_dwell 12 s"] = HandsSettings(quiet_dwell=12.0)
        if name.startswith(("tyre", "friction")):
            known = estimated(700, 4, WALKS[1], setting)
            off = (known.on == 0) & (known.valid > 0)
            fitting = HandsSettings().floored(known.torque[off], known.band[off])
            ways[f"the same, floor {fitting.floor:.2f} N m from other drives' hands off"] = fitting
            ways["and correlation 0.1 s"] = replace(fitting, correlation=0.1)
        for way, settings in ways.items():
            rows.append([*row(way, judge_hands(seen.hands(settings), seen.on, DT)), f"{share:.3f}"])
    print("\n" + table(["drive", *head[1:], "log loss of the share"], rows))


def recorded(data: Path) -> None:
    """Driver torque and hands in the assisted car; shaft torque in the simulator.

    Args:
        data: folder that holds the recordings.
    """
    lacking = [name for name in ("comma2k19-rav4", "iracing/amg.ibt") if not (data / name).exists()]
    if lacking:
        sys.exit(f"{data} lacks {', '.join(lacking)}: give the folder of recordings, hands.py recorded FOLDER")
    from codriver.papers.steering2019.recorded_column import (
        assisted_column,
        brush,
        correlation_time,
        explained,
        hands_by,
        linear,
        regression,
        shaft,
    )

    car = assisted_column(data / "comma2k19-rav4")
    on, rows = car.span(0, 8.9), []
    for begin, end, first, last in ((13, 40, 40, 59), (35, 59, 13, 35)):
        fitted, judged = car.span(begin, end), car.span(first, last)
        z, sensor = car.estimate(fitted), car.sensor - np.median(car.sensor[fitted])
        rms = [float(np.sqrt(np.mean(z[part] ** 2))) for part in (fitted, judged, on)]
        line = np.polyfit(z[on], car.sensor[on], 1)
        said = [hands_by(x, float(np.sqrt(np.mean(x[fitted] ** 2))), correlation_time(z[fitted])) for x in (z, sensor)]
        rows.append([
            f"{begin} to {end} s", *(f"{explained(car.motor[p], car.motor[p] + z[p]):.2f}" for p in (fitted, judged)),
            *(f"{x:.0f}" for x in rms), f"{np.corrcoef(z[on], car.sensor[on])[0, 1]:.2f}",
            f"{explained(car.sensor[on], np.polyval(line, z[on])):.2f}",
            *(f"{p[part].mean():.2f}" for p in said for part in (on, judged)),
        ])  # fmt: skip
    head = ["fitted", "R2 there", "R2 on the other half", "rms fitted", "rms other half", "rms hands on", "correlation", "R2",
            "p on", "p off", "p on, by the sensor", "p off, by the sensor"]  # fmt: skip
    print(table(head, rows))
    s, rows = shaft(data / "iracing" / "amg.ibt"), []
    for split, last in ((38, 47), (41, 47), (41, 49)):
        fitted, judged = s.time < split, (s.time > split) & (s.time < last)
        ways = {
            "eq. (92)": linear(s, fitted)[1], "eq. (92), saturating": brush(s, fitted)[1],
            "angle": regression(s, fitted, s.angle), "lateral acceleration": regression(s, fitted, s.lateral),
            "both": regression(s, fitted, s.angle, s.lateral),
        }  # fmt: skip
        print(
            f"\nto {split} s: linear",
            *np.round(linear(s, fitted)[0], 3),
            "saturating",
            *np.round(brush(s, fitted)[0], 3),
        )
        for name, T in ways.items():
            scores = [f"{explained(s.torque[part], T[part]):.3f}" for part in (fitted, judged)]
            rmse = np.sqrt(np.mean((T - s.torque)[judged] ** 2))
            rows.append([f"{split} to {last} s", name, *scores, f"{rmse:.2f}"])
    print("\n" + table(["judged", "way", "R2 fitted", "R2 judged", "RMSE, N m"], rows))


if __name__ == "__main__":
    what = sys.argv[1] if len(sys.argv) > 1 else "12"
    if what == "recorded":
        if len(sys.argv) < 3:
            sys.exit("hands.py recorded needs the folder that holds the recordings: hands.py recorded FOLDER")
        recorded(Path(sys.argv[2]))
    elif what == "fit":
        fit()
    else:
        main(int(what))
