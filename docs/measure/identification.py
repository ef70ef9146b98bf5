"""Figures of docs/identification.md: `python docs/measure/identification.py`; takes two minutes."""

# ruff: noqa: T201
from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import codriver as cd
from codriver.errors import LogError
from codriver.identify import check_vehicle_against_log, identify_brake, identify_pedal, identify_ratio
from codriver.identify import usable as masks
from codriver.identify.regression import regress
from codriver.simulate import road_test

TRUE = {"c_b": 189e-5, "kappa_1": 131.0 - 1550 * 0.05, "kappa_2": 0.283, "gamma": 0.0015 * 9.80665}
DRIVES = (("ordinary", 1), ("smooth", 2), ("aggressive", 3), ("anticipating", 4), ("nervous", 5), ("brisk", 6))


def main() -> None:
    """Print everything."""
    car = cd.load_vehicle("bisoffi2017")
    logs = {f"{style}, seed {seed}": road_test(style, seed).log for style, seed in DRIVES}
    print("error of c_b %, kappa_1 N, kappa_2 %, gamma; in brackets the standard error")
    for what, pitch in (("with gamma", True), ("without", False)):
        print(what)
        for name, log in logs.items():
            print(f"  {name}: {told(log, car, pitch=pitch)}")
    log = logs["ordinary, seed 1"]
    print("the ordinary drive, changed:")
    print(f"  M + 5 %, with gamma: {told(log, car.with_parameter('mass', 1.05 * 1550, source=''))}")
    print(f"  M + 5 %, without: {told(log, car.with_parameter('mass', 1.05 * 1550, source=''), pitch=False)}")
    for name in ("brake_pressure", "engine_torque"):
        for delay in (-0.02, 0.02):
            print(f"  {name} {delay:+.2f} s: {told(delayed(log, name, delay), car)}")
    print(f"  all six drives at once: {told(list(logs.values()), car)}")
    print(f"  shifts not masked: {unmasked(log, car)}")
    print("error of c_r, %; and of tau by gear, %")
    for name, one in logs.items():
        ratio = identify_ratio(one)
        known = car.numbers("transmission")
        taus = ", ".join(f"{g.gear}: {(g.ratio * 1550 / known[g.gear - 1] - 1) * 100:+.2f}" for g in ratio.gears)
        gain = "" if ratio.gain is None else f", gamma {ratio.gain[0]:.4f} ({ratio.gain[1]:.4f})"
        print(f"  {name}: {(identify_pedal(one).c_r / 325 - 1) * 100:+.3f}; {taus}{gain}")
    part = log.between(0, 600)
    print(f"identify_brake {clock(lambda: identify_brake(log, car)):.2f} s")
    print(f"check of 10 minutes {clock(lambda: check_vehicle_against_log(part, car)):.3f} s")
    print(f"intervals of 300 short regressions with AR(1) residuals that hold the truth: {coverage()}")


def told(log: cd.Log | list[cd.Log], car: cd.Vehicle, *, pitch: bool = True) -> str:
    """Errors of one fit."""
    try:
        fit = identify_brake(log, car, pitch=pitch)
    except LogError as error:
        return error.found
    parts = []
    for name in TRUE:
        if name in fit.coefficients:
            c, true = fit.coefficients[name], TRUE[name]
            scale, form = (
                (100 / true, "+.2f") if name in ("c_b", "kappa_2") else (1.0, "+.1f" if name == "kappa_1" else "+.4f")
            )
            parts.append(f"{name} {(c.value - true) * scale:{form}} ({c.sd * scale:{form[1:]}})")
    late = [abs(p.value / TRUE["c_b"] - 1) for p in fit.curve if p.minutes >= 2 and p.braking > 0]
    before = "-" if fit.rmse_old is None else f"{fit.rmse_old:.4f}"
    return (
        f"{'; '.join(parts)}; worst of the curve from 2 min {max(late):.2%}; RMSE {fit.rmse:.4f} (old {before}, constant "
        f"{fit.rmse_constant:.2f}); fitted on {fit.minutes_fit:.1f} min, {fit.minutes_braking:.1f} braking, block {fit.block:.1f} s"
    )


def delayed(log: cd.Log, name: str, seconds: float) -> cd.Log:
    """One signal later."""
    s = log[name]
    return log.with_signals(cd.Signal(name, s.time + seconds, s.values, s.unit))


def unmasked(log: cd.Log, car: cd.Vehicle) -> str:
    """As `told`, with gear shifts used like everything else."""
    before, after = masks.BEFORE_SHIFT, masks.AFTER_SHIFT
    closed = changed(changed(log, "clutch", lambda x: 0 * x), "gear", lambda x: x)
    masks.BEFORE_SHIFT = masks.AFTER_SHIFT = 0.0
    try:
        return told(closed, car)
    finally:
        masks.BEFORE_SHIFT, masks.AFTER_SHIFT = before, after


def changed(log: cd.Log, name: str, work: Callable[[np.ndarray], np.ndarray]) -> cd.Log:
    """One signal's values worked on."""
    s = log[name]
    return log.with_signals(cd.Signal(name, s.time, work(s.values), s.unit))


def coverage() -> str:
    """How often a 95 % interval holds the truth."""
    from scipy.signal import lfilter

    said = []
    for a in (0.0, 0.9, 0.97):
        inside = []
        for seed in range(300):
            rng = np.random.default_rng([seed, 8])
            X = np.column_stack([np.ones(3000), lfilter([1], [1, -0.95], rng.standard_normal(3000))])
            y = X @ [0.5, 1.0] + lfilter([1], [1, -a], rng.standard_normal(3000))
            found = regress(X, y, np.ones(3000, bool), np.array([0, 3000]), seed=seed)
            inside.append(np.abs(found.solution - [0.5, 1.0]) < found.interval_factor * found.sd)
        share = np.mean(inside, axis=0)
        said.append(f"{a:g}: {share[0]:.1%}, {share[1]:.1%}")
    return "; ".join(said)


def clock(work: Callable[[], object]) -> float:
    """Seconds, the best of three."""
    took = []
    for _ in range(3):
        begun = time.perf_counter()
        work()
        took.append(time.perf_counter() - begun)
    return min(took)


if __name__ == "__main__":
    main()
