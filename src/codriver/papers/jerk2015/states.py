"""2015 section V: the offset over two laps (figure 1), and the states at three values of the knob (figure 2)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from codriver.drivers.slopes import GRAVITY
from codriver.estimate import Estimate
from codriver.papers.drawing import (
    BLUE,
    GREEN,
    RED,
    curve,
    measured,
    shades,
    true_curve,
    window_between,
    window_in,
)
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Curve, Plot
from codriver.signals.signal import Array
from codriver.simulate.compare import shifting
from codriver.simulate.judge import at, rms
from codriver.simulate.track import LAP

COLORS = {2.0: GREEN, 1.4: BLUE, 0.8: RED}
_SHOWN = 40.0  # s of the drive in figure 2
_STEP = 2.0  # m, when two laps are laid over one another


def states_chapter(driven: Driven, intent: Mapping[float, Estimate], kinematic: Estimate) -> Chapter:
    """Figures 1 and 2.

    Args:
        driven: the drive.
        intent: intent-torque at each ell.
        kinematic: at the middle ell.
    """
    middle = intent[1.4]
    words = ("The track is made up: a lap of 4.5 km on a slope, driven twice.",)
    return Chapter("The states (V, figures 1 and 2)", words, (_offset(driven, intent), _states(driven, intent)),
                   (*_figure1(driven, intent, kinematic), *_figure2(driven, intent, middle)))  # fmt: skip


def _degrees(offset: Array) -> Array:
    return np.degrees(offset / GRAVITY)


def _offset(driven: Driven, intent: Mapping[float, Estimate]) -> Chart:
    whole = window_in(intent[1.4], driven.truth, 0.0, 1e9)
    curves = []
    for ell, estimate in intent.items():
        values = np.where(estimate.valid, _degrees(estimate.columns["acceleration_offset"]), np.nan)
        curves.append(Curve(f"ell = {ell:g}", estimate.time, values, COLORS[ell], width=1.1))
    time = intent[1.4].time
    true = Curve("true", time, _degrees(at(driven.truth, "acceleration_offset", time)), BLACK, dash="dot", width=1.2)
    return Chart("Figure 1: the estimated offset, over g, as an angle", "time (s)",
                 (Plot("o_a / g (°)", (*curves, true), 240, (0.0,)),),
                 "Slope and bias together; the second lap repeats the first. Blue: gear shifts; pink: braking.",
                 shades(intent[1.4], whole))  # fmt: skip


def _states(driven: Driven, intent: Mapping[float, Estimate]) -> Chart:
    middle = intent[1.4]
    start = float(middle.time[0]) + 60.0
    part = window_between(middle, start, start + _SHOWN)
    log = driven.log

    def lines(output: str) -> tuple[Curve, ...]:
        return tuple(curve(f"ell = {ell:g}", estimate, output, part, COLORS[ell]) for ell, estimate in intent.items())

    return Chart(
        "Figure 2: speed, intended acceleration and jerk", "time (s)",
        (
            Plot("speed (km/h)", (measured("measured", log, "longitudinal_speed", start, start + _SHOWN, BLACK),
                                  *lines("longitudinal_speed")), 150),
            Plot("acceleration (m/s²)", (
                measured("accelerometer", log, "longitudinal_acceleration", start, start + _SHOWN, faint=True),
                *lines("intentional_acceleration")), 200, (0.0,)),
            Plot("jerk (m/s³)", (*lines("intentional_jerk"),
                                 true_curve("driver's plan", middle, driven.truth, "planned_jerk", part)), 200, (0.0,)),
        ),
        "", shades(middle, part),
    )  # fmt: skip


def _figure1(driven: Driven, intent: Mapping[float, Estimate], kinematic: Estimate) -> tuple[Item, ...]:
    alike = {ell: _laps_alike(driven, estimate) for ell, estimate in intent.items()}
    steepest = float(np.max(np.abs(np.degrees(driven.truth["road_slope"].values))))
    middle = intent[1.4]
    seen = np.abs(_degrees(middle.columns["acceleration_offset"][middle.valid]))
    return (
        Item("fig. 1: the offset is periodic with the two laps", "periodic", alike[1.4], "1", min(alike.values()) > 0.8,
             "correlation of the first lap with the second over the distance; at ell = "
             + ", ".join(f"{ell:g}: {value:.2f}" for ell, value in alike.items()) + ". Above 0.8 for each counts"),
        Item("II: the slope stays below 10 degrees, as figure 1 lets check a posteriori", "below 10", float(seen.max()), "°",
             bool(seen.max() < 10), f"greatest estimate, bias included; the track's steepest slope is {steepest:.1f} degrees"),
    )  # fmt: skip


def _laps_alike(driven: Driven, estimate: Estimate) -> float:
    """Correlation of the offset on the first lap with that on the second, over the distance."""
    distance = np.maximum.accumulate(at(driven.truth, "distance", estimate.time))
    values = np.where(estimate.valid, estimate.columns["acceleration_offset"], np.nan)
    s = np.arange(100.0, LAP - 100.0, _STEP)
    laps = [np.interp(s + lap * LAP, distance, values) for lap in (0, 1)]
    both = np.isfinite(laps[0]) & np.isfinite(laps[1])
    return float(np.corrcoef(laps[0][both], laps[1][both])[0, 1])


def _figure2(driven: Driven, intent: Mapping[float, Estimate], middle: Estimate) -> tuple[Item, ...]:
    used = middle.valid & (middle.columns["speed_used"] > 0.5)
    speed = rms((middle.columns["longitudinal_speed"] - middle.grid.values["longitudinal_speed"])[used])
    span = float(np.ptp(middle.columns["longitudinal_speed"]))
    fed = middle.grid.values["longitudinal_acceleration"] - sum(
        middle.columns[name] for name in ("intentional_acceleration", "acceleration_offset")
    )
    u = middle.columns["known_input"]
    active = middle.valid & (np.abs(u) > 0.3)
    alike = float(np.corrcoef(fed[active], u[active])[0, 1]) if active.any() else float("nan")
    torque = middle.grid.values["engine_torque"] - middle.grid.values["engine_torque_request"]
    calm = middle.valid & ~shifting(driven.truth, middle.time)
    jerks = {ell: estimate.columns["intentional_jerk"] for ell, estimate in intent.items()}
    rough = {ell: rms(np.diff(jerk[middle.valid]) / middle.grid.dt) for ell, jerk in jerks.items()}
    ells = sorted(rough)
    size = np.abs(jerks[1.4][middle.valid])
    quiet = float(np.mean(size < 0.25 * np.percentile(size, 99)))
    caught, planned = _captured(driven, middle)
    return (
        Item("fig. 2: the speed estimate is barely distinguishable from the measurement", "barely distinguishable", speed, "m/s",
             speed < 0.005 * span, f"rms difference, ell = 1.4; speeds span {span:.1f} m/s; below 0.5 % of it counts"),
        Item("fig. 2: a_i differs from y_1 by the direct feed-through of u", "feed-through", alike**2, "1", alike**2 > 0.5,
             "share of the variance of y_1 − a_i − o_a that u explains where |u| > 0.3 m/s²; a half counts. The rest is the "
             "observer's lag and the driveline's ringing"),
        Item("fig. 2: T_e − T_r holds a slowly varying offset, the engine's losses", "a slow offset",
             float(np.mean(torque[calm])), "N m", None,
             f"mean of T_e − T_r outside shifts, scatter {np.std(torque[calm]):.1f} N m; the simulated unit reports both torques "
             "after the engine's losses, so only its drag with the pedal released is left of it"),
        Item("fig. 2: a smaller ell smooths", "smoother", ", ".join(f"{rough[ell]:.2f}" for ell in ells) + " m/s⁴", "",
             all(rough[a] < rough[b] for a, b in itertools.pairwise(ells)),
             "rms rate of the estimated jerk, ell = " + ", ".join(f"{ell:g}" for ell in ells)),
        Item("V: the jerk is typically zero", "zero", quiet, "1", quiet > 0.5,
             "share of the time with the jerk below a quarter of its 99th percentile; above a half counts"),
        Item("V: the relevant changes of intention are well captured", "all", f"{caught} of {planned}", "",
             caught >= 0.9 * planned, "bursts planned by the simulated driver whose jerk passes 0.8 m/s³, and that the estimate "
             "answers with 0.25 m/s³ of the same sign within 2.5 s; nine of ten count"),
    )  # fmt: skip


def _captured(driven: Driven, estimate: Estimate) -> tuple[int, int]:
    """How many of the driver's larger planned bursts the estimate answers, and how many there are."""
    planned = at(driven.truth, "planned_jerk", estimate.time)
    jerk, dt = estimate.columns["intentional_jerk"], estimate.grid.dt
    caught = count = 0
    for sign in (1.0, -1.0):
        large = sign * planned > 0.8
        for start in np.flatnonzero(np.diff(large.astype(np.int8), prepend=0) == 1):
            stop = start + round(2.5 / dt)
            if stop < jerk.size and estimate.valid[start:stop].mean() > 0.95:
                count += 1
                caught += bool(np.max(sign * jerk[start:stop]) > 0.25)
    return caught, count
