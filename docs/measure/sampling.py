"""Figures of docs/sampling.md: rates, ticks, holes, jitter. python docs/measure/sampling.py"""

# ruff: noqa: T201
from __future__ import annotations

from collections import defaultdict

import numpy as np
from drives import rms, table

import codriver as cd
from codriver.simulate.demo import DURATION
from codriver.simulate.drive import drive
from codriver.simulate.road import demo_road
from codriver.simulate.sensors import Instruments, SensorParameters
from codriver.simulate.truth import truth_log

SEEDS = range(11, 16)
ELL = 2.0
A, V = "longitudinal_acceleration", "longitudinal_speed"
FORMS = ("kalman", "constant")


def clock(rate: float, seconds: float = DURATION - 0.1, jitter: float = 0.0) -> np.ndarray:
    """Stamps at a rate, Hz, off the even clock by `jitter` s."""
    time = np.arange(int(seconds * rate)) / rate
    return np.sort(np.clip(time + jitter * np.random.default_rng(3).standard_normal(time.size), 0, None))


def noisy(instruments: Instruments, time_a: np.ndarray, time_v: np.ndarray) -> cd.Log:
    """Accelerometer and speed as the sensors show them."""
    a, v = instruments.read(A, time_a), instruments.read("wheel.rear_left", time_v)
    return cd.Log.of([cd.Signal(A, time_a, a, ""), cd.Signal(V, time_v, v, "")])


def clean(truth: cd.Log, time_a: np.ndarray, time_v: np.ndarray) -> cd.Log:
    """The same without noise, ringing and pitch."""
    a = np.interp(time_a, truth[A].time, truth[A].values + truth["acceleration_offset"].values)
    v = np.interp(time_v, truth[V].time, truth[V].values)
    return cd.Log.of([cd.Signal(A, time_a, a, ""), cd.Signal(V, time_v, v, "")])


def jerk(log: cd.Log, dt: float = 0.01, form: str = "kalman") -> cd.Estimate:
    """The kinematic estimate."""
    return cd.compile(cd.build("kinematic", dt=dt, ell=ELL, form=form)).run(log, start=0.0, stop=DURATION - 0.2)


def lag(time_a: np.ndarray, time_v: np.ndarray, dt: float, form: str = "kalman") -> float:
    """Delay of the jerk, s: by how much the estimate of a jerk that grows steadily stays behind; inf if it does not settle."""
    log = cd.Log.of([cd.Signal(A, time_a, time_a**2 / 2, ""), cd.Signal(V, time_v, 20 + time_v**3 / 6, "")])
    e = cd.compile(cd.build("kinematic", dt=dt, ell=ELL, form=form)).run(log, start=0.0)
    behind = (e.time - e["longitudinal_jerk"].values)[-round(5 / dt) :]
    return float(behind.mean()) if np.ptp(behind) < 0.1 else float("inf")


def holes(log: cd.Log) -> dict[str, cd.Estimate]:
    """The speed missing for 2 s of every 10 s, met in four ways."""
    speed = log[V]
    kept = np.mod(speed.time, 10) > 2
    gappy = log.with_signals(cd.Signal(V, speed.time[kept], speed.values[kept], ""))
    newest = np.maximum.accumulate(np.where(kept, np.arange(kept.size), 0))
    holding = log.with_signals(cd.Signal(V, speed.time, speed.values[newest], ""))
    stamps = gappy[A].time
    near = (
        np.abs(gappy[V].time[np.clip(np.searchsorted(gappy[V].time, stamps - 1e-6), 0, kept.sum() - 1)] - stamps) < 1e-6
    )
    rows = gappy.with_signals(cd.Signal(A, stamps[near], gappy[A].values[near], ""))
    return {
        "no gaps, Kalman form": jerk(log), "no gaps, constant form": jerk(log, form="constant"),
        "gaps, Kalman form": jerk(gappy), "gaps, constant form": jerk(gappy, form="constant"),
        "gaps, last speed held": jerk(holding), "gaps, whole rows dropped": jerk(rows),
    }  # fmt: skip


def main() -> None:
    """Measure and print."""
    found = defaultdict(list)
    rates = ((100, 100), (100, 50), (100, 20), (100, 10), (50, 50), (20, 20))
    ticks = ((0.005, 100, 50), (0.01, 100, 50), (0.02, 100, 50), (0.02, 50, 50), (0.05, 20, 20))
    for seed in SEEDS:
        trace = drive(demo_road(), DURATION, seed=seed)
        sensors, truth = Instruments(trace, SensorParameters(), seed), truth_log(trace, rate=500.0)

        def scatter(times: tuple, dt: float = 0.01, form: str = "kalman", sensors=sensors, truth=truth) -> float:
            """What noise, ringing and pitch do: noisy against clean signals with the same stamps."""
            a, b = jerk(noisy(sensors, *times), dt, form), jerk(clean(truth, *times), dt, form)
            return rms((a["longitudinal_jerk"].values - b["longitudinal_jerk"].values)[b.valid])

        for rate in rates:
            found["rate", "{} / {}".format(*rate)].append(
                [scatter((clock(rate[0]), clock(rate[1])), form=f) for f in FORMS]
            )
        for dt, *rate in ticks:
            found["tick", f"{1 / dt:g} | {rate[0]} / {rate[1]}"].append([scatter((clock(rate[0]), clock(rate[1])), dt)])
        even = clock(100), clock(50)
        bests = {form: jerk(clean(truth, *even), form=form) for form in FORMS}
        best = bests["kalman"]
        for jitter in (0.0, 0.001, 0.003):
            e = jerk(noisy(sensors, clock(100, jitter=jitter), clock(50, jitter=jitter)))
            off = (e["longitudinal_jerk"].values - best["longitudinal_jerk"].values)[best.valid]
            found["jitter", f"{1000 * jitter:g} ms"].append([rms(off)])
        estimates = holes(noisy(sensors, *even))
        near = best.valid & (np.mod(best.time, 10) < 3)
        for name, e in estimates.items():
            same = bests["constant" if "constant" in name else "kalman"]
            off = e["longitudinal_jerk"].values - same["longitudinal_jerk"].values
            trusted = best.valid & e.valid
            found["holes", name].append(
                [rms(off[best.valid]), rms(off[near]), rms(off[trusted]), trusted.sum() / best.valid.sum()]
            )
    delays = {
        ("rate", "{} / {}".format(*r)): [lag(clock(r[0], 60), clock(r[1], 60), 0.01, f) for f in FORMS] for r in rates
    }
    delays |= {("tick", f"{1 / t:g} | {a} / {v}"): [lag(clock(a, 60), clock(v, 60), t)] for t, a, v in ticks}
    print(
        f"`kinematic`, mean of {len(SEEDS)} drives, ell = {ELL:g}; delay in s, scatter and error of the jerk in m/s^3 rms"
    )
    heads = {
        "rate": ["accelerometer / speed, Hz", "delay, Kalman", "delay, constant", "scatter, Kalman", "scatter, constant"],
        "tick": ["tick, Hz", "accelerometer / speed, Hz", "delay", "scatter"], "jitter": ["jitter", "error"],
        "holes": ["", "error, all", "error, gaps and 1 s after", "error, where it says valid", "share valid"],
    }  # fmt: skip
    for group, head in heads.items():
        rows = []
        for key, values in found.items():
            if key[0] == group:
                rows.append([key[1], *(f"{x:.3f}" for x in [*delays.get(key, []), *np.mean(values, axis=0)])])
        print("\n" + table(head, rows))


if __name__ == "__main__":
    main()
