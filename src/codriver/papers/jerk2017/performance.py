"""2017 section IV-B: the estimate on a varied stretch of road, and what the knob does (figures 4 and 5)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from codriver.estimate import Estimate
from codriver.papers.drawing import (
    ELL_COLORS,
    GREEN,
    PURPLE,
    Window,
    curve,
    measured,
    shades,
    true_curve,
    window_in,
)
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import Chart, Curve, Plot, Table
from codriver.simulate import ROAD_TEST_STRETCHES
from codriver.simulate.judge import at, rms

BOXES = ("ramp", "bend", "other_car", "roundabout")
_BURST = 0.5  # m/s^3: a jerk beyond this counts as a burst; large ones of an ordinary driver reach 1 to 2


def performance_chapter(driven: Driven, estimates: Mapping[float, Estimate], pedals: Estimate) -> Chapter:
    """Figures 4 and 5.

    Args:
        driven: the drive of the sixth driver.
        estimates: intent-pedals at ell 1, 2, 3.
        pedals: pedals-only on the same ticks.
    """
    middle = estimates[2.0]
    comparison = ROAD_TEST_STRETCHES["comparison"]
    part = window_in(middle, driven.truth, comparison.start, comparison.stop)
    words = (
        "The stretch follows the paper's description of its figure 4: an exit ramp with a give-way line and a strong "
        "acceleration onto a main road (box 1), a sharp bend (2), another car that makes the driver brake and then goes "
        "(3), a roundabout (4). Road, car and driver are simulated; the paper's photographs (figure 5) have no counterpart.",
    )
    items = (*_figure4(driven, estimates, pedals, part), *_boxes(driven, middle), *_knob(driven, estimates))
    return Chapter(
        "Performance of the estimation scheme (IV-B)", words, (_chart(driven, estimates, part), _scenes()), items
    )


def _chart(driven: Driven, estimates: Mapping[float, Estimate], part: Window) -> Chart:
    log, middle = driven.log, estimates[2.0]
    start, stop = float(middle.time[part.first]), float(middle.time[part.last])
    ells = sorted(estimates, reverse=True)

    def lines(output: str) -> list[Curve]:
        return [curve(f"ell = {ell:g}", estimates[ell], output, part, ELL_COLORS[ell]) for ell in ells]

    boxes = []
    for number, name in enumerate(BOXES, 1):
        box = window_in(middle, driven.truth, ROAD_TEST_STRETCHES[name].start, ROAD_TEST_STRETCHES[name].stop)
        boxes.append((float(middle.time[box.first]), float(middle.time[box.last]), str(number)))
    return Chart(
        "Figure 4: the estimate at three values of the knob", "time (s)",
        (
            Plot("speed (km/h)", (measured("measured", log, "longitudinal_speed", start, stop, "#1a1a1a"),
                                  *lines("longitudinal_speed")), 150),
            Plot("accelerator (%)", (measured("accelerator p_r", log, "accelerator_pedal", start, stop, PURPLE),
                                     measured("brake p_b (right)", log, "brake_pressure", start, stop, GREEN, right=True)),
                 130, right_label="bar"),
            Plot("acceleration (m/s²)", (measured("accelerometer", log, "longitudinal_acceleration", start, stop, faint=True),
                                         *lines("intentional_acceleration"),
                                         true_curve("driver's plan", middle, driven.truth, "planned_acceleration", part)),
                 220, (0.0,)),
            Plot("jerk (m/s³)", (*lines("intentional_jerk"),
                                 true_curve("driver's plan", middle, driven.truth, "planned_jerk", part)), 220, (0.0,)),
        ),
        "Pink: the driver brakes; blue: a gear shift. Shifts that the accelerometer shows are gone from the intention. A larger "
        "ell is earlier and noisier.",
        shades(middle, part), tuple(boxes),
    )  # fmt: skip


def _scenes() -> Table:
    rows = tuple((str(n), ROAD_TEST_STRETCHES[name].meaning) for n, name in enumerate(BOXES, 1))
    return Table(("box", "scene (figure 5)"), rows)


def _figure4(driven: Driven, estimates: Mapping[float, Estimate], pedals: Estimate, part: Window) -> tuple[Item, ...]:
    """The claims on figure 4's curves, over the stretch."""
    middle = estimates[2.0]
    used = part(middle.valid & (middle.columns["speed_used"] > 0.5))
    speed_error = rms(part(middle.columns["longitudinal_speed"] - middle.grid.values["longitudinal_speed"])[used])
    scale = float(np.ptp(part(middle.columns["longitudinal_speed"])))
    valid = part(middle.valid & pedals.valid)
    a_i = part(middle.columns["intentional_acceleration"])[valid]
    sums = part(pedals.columns["intentional_acceleration"])[valid]
    raw = part(middle.grid.values["longitudinal_acceleration"])[valid]
    alike, raw_alike = _correlation(a_i, sums), _correlation(raw, sums)
    whole = np.abs(middle.columns["intentional_jerk"][middle.valid])
    calm = float(np.mean(whole < 0.25 * np.percentile(whole, 99)))
    shift = middle.valid & middle.flag("gear_shift")
    true = at(driven.truth, "intentional_acceleration", middle.time)
    ours = rms((middle.columns["intentional_acceleration"] - true)[shift])
    theirs = rms(
        (middle.grid.values["longitudinal_acceleration"] - middle.columns["acceleration_offset"] - true)[shift]
    )
    return (
        Item("fig. 4: the speed estimate is barely distinguishable from the measurement", "barely distinguishable",
             speed_error, "m/s", speed_error < 0.005 * scale,
             f"rms difference over the stretch, ell = 2, where speeds span {scale:.1f} m/s; below 0.5 % of the span counts"),
        Item("fig. 4: gear shifts in y_1 are rejected in the intentional acceleration", "suitably rejected", ours / theirs, "1",
             ours < 0.5 * theirs, f"rms error in shifts against the model's intention, ours ({ours:.2f} m/s²) over the "
             f"accelerometer's without offset ({theirs:.2f} m/s²); below a half counts. Ours includes the lag"),
        Item("fig. 4: the intentional acceleration resembles a weighted sum of p_r and −p_b", "more than y_1 does", alike, "1",
             alike > 0.9 and alike > raw_alike, f"correlation with a_i^P of eq. (23); that of the accelerometer: {raw_alike:.3f}"),
        Item("IV-B: the baseline of the intentional jerk is zero", "zero", calm, "1", calm > 0.5,
             "share of the whole drive with the jerk below a quarter of its 99th percentile; above a half counts"),
    )  # fmt: skip


def _boxes(driven: Driven, middle: Estimate) -> tuple[Item, ...]:
    """The bursts in the magenta boxes: signs and order."""
    claims = {
        "ramp": ("negative burst (give way), then positive (joins the main road)", (-1, 1)),
        "bend": ("negative burst before the brake", (-1,)),
        "other_car": ("from negative to positive", (-1, 1)),
        "roundabout": ("a negative burst, then positive ones", (-1, 1)),
    }
    items = []
    for number, (name, (claim, signs)) in enumerate(claims.items(), 1):
        found = bursts(driven, middle, name)
        items.append(Item(f"fig. 4 and 5, box {number}: {claim}", claim, _largest(found, signs), "", in_order(found, signs),
                          f"the largest of {len(found)} peaks of the jerk beyond {_BURST:g} m/s³ in the box, ell = 2"))  # fmt: skip
    return tuple(items)


def _largest(found: list[float], signs: tuple[int, ...]) -> str:
    """The largest burst of the first sign, the largest of the next one after it, and so on, in words."""
    said, rest = [], found
    for sign in signs:
        if not any(value * sign > 0 for value in rest):
            break
        k = max(range(len(rest)), key=lambda index: rest[index] * sign)
        said.append(f"{rest[k]:+.1f}")
        rest = rest[k + 1 :]
    return ", then ".join(said) + " m/s³" if said else "none"


def bursts(driven: Driven, estimate: Estimate, stretch: str) -> list[float]:
    """Peaks of the estimated jerk (m/s^3) beyond _BURST in a stretch of the road, in order of time; one until it fades."""
    place = ROAD_TEST_STRETCHES[stretch]
    part = window_in(estimate, driven.truth, place.start, place.stop)
    jerk = np.where(part(estimate.valid), part(estimate.columns["intentional_jerk"]), 0.0)
    side = np.where(np.abs(jerk) > 0.5 * _BURST, np.sign(jerk), 0.0)
    edges = np.flatnonzero(np.diff(side, prepend=0.0, append=0.0))
    pieces = [jerk[a:b] for a, b in itertools.pairwise(edges) if side[a] != 0]
    peaks = [float(piece[np.argmax(np.abs(piece))]) for piece in pieces]
    return [peak for peak in peaks if abs(peak) > _BURST]


def in_order(found: list[float], signs: tuple[int, ...]) -> bool:
    """Whether bursts of these signs occur in this order, others between them or not."""
    rest = iter(found)
    return all(any(value * sign > 0 for value in rest) for sign in signs)


def _knob(driven: Driven, estimates: Mapping[float, Estimate]) -> tuple[Item, ...]:
    """The effect of ell, measured on the drive: lag, and noise in calm stretches."""
    lags, noises = {}, {}
    for score in driven.scores:
        if score.estimator == "intent-pedals" and score.truth == "model" and score.ell in estimates:
            lags[score.ell] = score.lag
    for ell, estimate in estimates.items():
        true = np.abs(at(driven.truth, "intentional_jerk", estimate.time)) < 0.05
        around = round(3.0 / estimate.grid.dt)
        calm = np.convolve((~true).astype(float), np.ones(around))[: true.size] < 0.5  # for 3 s nothing was intended
        noises[ell] = float(np.std(estimate.columns["intentional_jerk"][calm & estimate.valid]))
    ordered = sorted(estimates)
    said_lag = ", ".join(f"{lags[ell]:.2f}" for ell in ordered)
    said_noise = ", ".join(f"{noises[ell]:.3f}" for ell in ordered)
    return (
        Item("IV-B: a larger ell is more reactive", "ell = 3 reacts most, ell = 1 least", f"{said_lag} s", "",
             all(lags[a] > lags[b] for a, b in itertools.pairwise(ordered)),
             "lag of the best correlation with the model's intention, ell = 1, 2, 3"),
        Item("IV-B: a larger ell is more prone to noise", "ell = 3 most, ell = 1 least", f"{said_noise} m/s³", "",
             all(noises[a] < noises[b] for a, b in itertools.pairwise(ordered)),
             "scatter of the jerk where for 3 s nothing was intended, ell = 1, 2, 3"),
    )  # fmt: skip


def _correlation(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.corrcoef(x, y)[0, 1])
