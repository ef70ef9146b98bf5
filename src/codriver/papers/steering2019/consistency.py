"""Beside 2019: whether the bands of the Kalman filters are honest, by NEES and NIS with their chi-square bounds.

    NIS = e^2 / s,     NEES = (x - x^)' P^-1 (x - x^),     x = (delta_s, omega_s, T_dr)

Each sum over independent records is chi-square with (records x dimension) degrees of freedom where the filter's model is the
record's: so records are made whose torque is the random walk that the filter takes it for. At one tick a record the bounds are
exact; the mean over many ticks must lie well inside. Then the same filters on the paper's sinusoids, which are no random walks.
Bar-Shalom, Li, Kirubarajan 2001, Estimation with Applications to Tracking and Navigation, section 5.4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import codriver.program as programs
from codriver.observers.driver_torque import driver_torque_design
from codriver.observers.torque_noise import TorqueNoise
from codriver.offline.smoothed import with_memory
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.papers.steering2019.filters import kalman
from codriver.papers.steering2019.runs import DEGREE, DT, WORDS, DrivenRuns, driven_runs, run_all
from codriver.report.document import Chart, Curve, Plot, Table
from codriver.signals.signal import Array
from codriver.torque_fit import fit_torque_noise
from codriver.vehicles import Vehicle, load_vehicle

SECONDS = 4.0  # so short that a walk turns no wheel quicker than wheels turn
CONFIDENCE = 0.999
SKIP = round(1 / DT)  # ticks: the start's covariance is the filter's own word
# Of encoder, wheel and torque: those of the preset okamoto2019, and a torque that changes by a N m in a second.
NOISES = {1: TorqueNoise(1, 0.1 * DEGREE, 0.01, 0.01, 1.0), 2: TorqueNoise(2, 0.1 * DEGREE, 0.01, 0.01, 0.5)}
NAMES = ("steering_wheel_angle", "steering_wheel_rate", "driver_torque")


@dataclass(frozen=True, eq=False)
class Consistency:
    """Of a filter over records.

    Attributes:
        nis, nees: mean over the records at each tick, shape (n,).
        records: how many.
        covered: share of the torques within 1.96 standard deviations, from 1 s on.
    """

    nis: Array
    nees: Array
    records: int
    covered: float

    @property
    def mean_nis(self) -> float:
        """From 1 s on."""
        return float(self.nis[SKIP:].mean())

    @property
    def mean_nees(self) -> float:
        """From 1 s on."""
        return float(self.nees[SKIP:].mean())

    def inside(self, which: str) -> float:
        """Share of the ticks from 1 s on whose mean over the records is inside the bounds."""
        low, high = bounds(self.records, 1 if which == "nis" else len(NAMES))
        values = (self.nis if which == "nis" else self.nees)[SKIP:]
        return float(np.mean((values > low) & (values < high)))


def bounds(records: int, dimension: int) -> tuple[float, float]:
    """Where the mean over independent records lies with CONFIDENCE."""
    from scipy.stats import chi2

    tail = (1 - CONFIDENCE) / 2
    low, high = chi2.ppf([tail, 1 - tail], records * dimension) / records
    return float(low), float(high)


def walking_runs(order: int, records: int, car: Vehicle, seed: int = 0) -> DrivenRuns:
    """Records whose torque is the random walk of a filter, and whose noise is the filter's."""
    noise = NOISES[order]
    design = driver_torque_design(car, noise, DT)
    rng = np.random.default_rng([seed, order, 17])
    n, size = round(SECONDS / DT) + 1, design.F.shape[0]
    time = np.arange(n, dtype=np.float64) * DT
    known = np.sin(4 * time)
    # Not positive definite to the last digit, for the torque's part is tiny: eigenvectors in place of Cholesky.
    values, vectors = np.linalg.eigh(design.Q_d)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    x = rng.standard_normal((records, size)) * [0.3, 1.0, 0.5, 0.5][:size]
    states = np.empty((records, n, size))
    for k in range(n):
        if k:
            pushed = design.G_0[:, 0] * known[k - 1] + design.G_1[:, 0] * known[k]
            x = x @ design.F.T + pushed + rng.standard_normal((records, size)) @ root.T
        states[:, k] = x
    measured = states[:, :, 0] + noise.angle * rng.standard_normal((records, n))
    same = np.tile(known, (records, 1))
    return DrivenRuns(time, same, states[:, :, 2], states[:, :, 0], states[:, :, 1], measured)


def judge_consistency(noise: TorqueNoise, records: DrivenRuns, car: Vehicle) -> Consistency:
    """NIS and NEES of the filter over the records."""
    carried = [f"P_{i}{k}" for i in range(3) for k in range(i, 3)]
    out = run_all(programs.compile(with_memory(kalman(noise, car), carried)), records)
    truth = (records.angle, records.rate, records.driver)
    error = np.stack([out[name] - true for name, true in zip(NAMES, truth, strict=True)], axis=-1)
    P = np.stack([np.stack([out[f"P_{min(i, k)}{max(i, k)}"] for k in range(3)], axis=-1) for i in range(3)], axis=-2)
    # In units of their standard deviations, so that angle and torque can stand in one matrix.
    sd = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
    correlation, scaled = P / (sd[..., :, None] * sd[..., None, :]), error / sd
    nees = np.einsum("rki,rki->rk", scaled, np.linalg.solve(correlation, scaled[..., None])[..., 0])
    nis = (out["steering_wheel_angle_innovation"] / out["steering_wheel_angle_innovation_sd"]) ** 2
    covered = np.abs(error[:, SKIP:, 2]) <= 1.96 * out["driver_torque_sd"][:, SKIP:]
    return Consistency(nis.mean(axis=0), nees.mean(axis=0), records.measured.shape[0], float(covered.mean()))


def consistency_chapter(seeds: int) -> Chapter:
    """NIS and NEES of the two Kalman filters."""
    car = load_vehicle("okamoto2019")
    own = {order: judge_consistency(NOISES[order], walking_runs(order, seeds, car), car) for order in NOISES}
    fitted = {
        reading: fit_torque_noise("driver-torque-logged", driven_runs(reading, 1, seed=1000).log(0), car, 1 / DT).noise
        for reading in ("derivative", "continuous")
    }
    sines = {reading: judge_consistency(noise, driven_runs(reading, seeds), car) for reading, noise in fitted.items()}
    items = []
    for order, c in own.items():
        walk = ("random walk", "walk integrated")[order - 1]
        for which, mean, dimension in (("nis", c.mean_nis, 1), ("nees", c.mean_nees, 3)):
            low, high = bounds(c.records, dimension)
            items.append(Item(
                f"{which.upper()} of the Kalman filter, torque a {walk}: {dimension} is expected", None, mean, "1",
                low < mean < high and c.inside(which) > 0.98,
                f"not in the paper; bounds of {CONFIDENCE:.1%} for {c.records} records: {low:.3f} to {high:.3f}; "
                f"{c.inside(which):.1%} of the ticks are inside",
            ))  # fmt: skip
    c = sines["derivative"]
    items.append(Item(
        "the band on the paper's sinusoids, noise fitted by likelihood", "95 %", f"{100 * c.covered:.0f} % of the torques inside",
        "",
        c.covered >= 0.9, f"a sine is no random walk: NEES {c.mean_nees:.2f} where 3 is expected, NIS {c.mean_nis:.2f}. At least "
        f"90 % counts. White noise of 0.01 dt: {100 * sines['continuous'].covered:.0f} %. The paper's PI observer has no band",
    ))  # fmt: skip
    words = (
        "The paper gives its estimate of the torque no error bar. The Kalman filters do; where the model is right their errors "
        "must be as large as they say.",
    )
    return Chapter("Are the bands honest? NEES and NIS", words, (_chart(own), _table(own, sines)), tuple(items))


def _chart(own: Mapping[int, Consistency]) -> Chart:
    plots = []
    for which, dimension in (("nis", 1), ("nees", 3)):
        low, high = bounds(own[1].records, dimension)
        curves = []
        for (order, c), color in zip(own.items(), ("#0072B2", "#C84C00"), strict=True):
            values = (c.nis if which == "nis" else c.nees)[SKIP::5]
            time = DT * np.arange(c.nis.size, dtype=np.float64)[SKIP::5]
            curves.append(Curve(f"{which.upper()}, order {order}", time, values, color, width=1.0))
        plots.append(Plot(which.upper(), tuple(curves), 160, (low, float(dimension), high)))
    return Chart(
        "NIS and NEES over time, mean of the records", "time (s)", tuple(plots), "Dotted: the expected value and its "
        f"{CONFIDENCE:.1%} bounds."
    )  # fmt: skip


def _table(own: Mapping[int, Consistency], sines: Mapping[str, Consistency]) -> Table:
    rows = [
        (f"its own random walk, order {order}", c.mean_nis, c.mean_nees, f"{c.covered:.1%}") for order, c in own.items()
    ]
    rows += [
        (f"the paper's sinusoids, noise {WORDS[reading]}", c.mean_nis, c.mean_nees, f"{c.covered:.1%}")
        for reading, c in sines.items()
    ]
    return Table(
        ("torque", "NIS (1)", "NEES (3)", "in the 95 % band"),
        tuple(rows),
        "Means from 1 s on; the expected value in brackets.",
    )
