"""Identification of a 42-minute drive, against the script that a user would write with numpy, scipy and statsmodels.

The script does what eq. (19)-(20) of the 2017 paper say, and gives Newey-West standard errors: samples on one clock, a low-pass
for each signal, a mask for shifts and standstill, least squares on the first half. It has neither pitch nor slip nor
outliers, no several logs, no refusals, and no learning curve.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from measure import Row, compared, measure

import codriver as cd
from codriver.identify import check_vehicle_against_log, identify_brake, identify_ratio
from codriver.simulate import road_test

TAUS, M = np.array([41.0, 22.0, 14.0, 10.0, 8.0]), 1550.0
LAGS = 200  # ticks of Newey and West: 2 s


def run(quick: bool) -> Iterator[Row]:
    """The rows."""
    log = road_test("ordinary", 1, duration=240.0 if quick else None).log
    minutes = (log.stop - log.start) / 60
    car = cd.load_vehicle("bisoffi2017")
    times = 1 if quick else 5
    found = identify_brake(log, car)
    ours = measure(lambda: identify_brake(log, car), times)
    plain = measure(lambda: plain_brake(log), 1 if quick else 3)
    c_b, sd = plain_brake(log)
    c = found.coefficients["c_b"]
    yield compared(
        f"identify c_b, kappa_1, kappa_2 from {minutes:.0f} min", ours.best, "numpy, scipy, statsmodels", plain.best,
        f"ours with masks, pitch, bootstrap and learning curve: {c.value * 1e5:.2f} ({c.sd * 1e5:.2f}) N/bar; the script "
        f"{c_b * 1e5:.2f} ({sd * 1e5:.2f}); true 189", spread=ours.spread,
    )  # fmt: skip
    ratio = measure(lambda: identify_ratio(log), times)
    other = measure(lambda: plain_ratio(log), 1 if quick else 3)
    yield compared(
        f"identify tau/M by gear from {minutes:.0f} min", ratio.best, "numpy, scipy, statsmodels", other.best,
        "as above", spread=ratio.spread,
    )  # fmt: skip
    part = log.between(log.start, log.start + 600.0)
    check = measure(lambda: check_vehicle_against_log(part, car), times)
    yield Row(
        f"hold a vehicle file against {min(minutes, 10):.0f} min", f"{check.best * 1e3:.3g} ms", target="below 300 ms",
        met=check.best < 0.3, note="check_vehicle_against_log; part of codriver estimate",
    )  # fmt: skip


def clock(log: cd.Log) -> dict[str, np.ndarray]:
    """Signals on 100 Hz, each the last value, low-passed at 5 Hz; and what a script masks."""
    from scipy.signal import lfilter

    names = (
        "longitudinal_acceleration", "longitudinal_speed", "engine_torque", "brake_pressure", "gear", "clutch",
    )  # fmt: skip
    time = np.arange(max(log[name].time[0] for name in names), log.stop, 0.01)
    x = {name: log[name].values[np.searchsorted(log[name].time, time, side="right") - 1] for name in names}
    a = np.exp(-2 * np.pi * 5.0 * 0.01)
    pass_low = lambda w: lfilter([1 - a], [1, -a], w, zi=[a * w[0]])[0]  # noqa: E731
    gear = np.clip(x["gear"].astype(int), 1, 5)
    busy = (x["clutch"] > 0.05) | (np.diff(gear, prepend=gear[0]) != 0)
    around = np.convolve(busy, np.ones(201), "same") > 0
    filtered = {
        "y": pass_low(x["longitudinal_acceleration"]), "v2": pass_low(x["longitudinal_speed"] ** 2),
        "T": pass_low(x["engine_torque"]), "force": pass_low(TAUS[gear - 1] * x["engine_torque"]),
        "p": pass_low(x["brake_pressure"]), "gear": gear,
    }  # fmt: skip
    return {**filtered, "keep": ~around & (x["longitudinal_speed"] > 2.0)}


def plain_brake(log: cd.Log) -> tuple[float, float]:
    """c_b and its standard error, N/Pa."""
    import statsmodels.api as sm

    x = clock(log)
    rows = np.flatnonzero(x["keep"])
    rows = rows[: rows.size // 2]
    X = np.column_stack([x["p"], np.ones_like(x["p"]), x["v2"]])[rows]
    fit = sm.OLS((x["force"] - M * x["y"])[rows], X).fit(cov_type="HAC", cov_kwds={"maxlags": LAGS})
    return float(fit.params[0]), float(fit.bse[0])


def plain_ratio(log: cd.Log) -> tuple[float, ...]:
    """tau/M by gear, 1/(kg m)."""
    import statsmodels.api as sm

    x = clock(log)
    pressed = np.convolve(x["p"] > 0.7e5, np.ones(201), "same") > 0
    rows = np.flatnonzero(x["keep"] & ~pressed)
    gears = [np.where(x["gear"] == g, x["T"], 0.0) for g in range(1, 6)]
    X = np.column_stack([*gears, -np.ones_like(x["p"]), -x["v2"]])[rows]
    fit = sm.OLS(x["y"][rows], X).fit(cov_type="HAC", cov_kwds={"maxlags": LAGS})
    return tuple(float(value) for value in fit.params[:5])
