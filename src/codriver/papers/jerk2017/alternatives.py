"""2017 section IV-C: against the kinematic model and the pedals alone (figure 6)."""

from __future__ import annotations

import numpy as np

from codriver.drivers.slopes import slope_percent
from codriver.estimate import Estimate
from codriver.papers.drawing import (
    BLUE,
    GREEN,
    PURPLE,
    TURQUOISE,
    Window,
    curve,
    measured,
    shades,
    window_in,
)
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Curve, Plot
from codriver.report.shown import number
from codriver.signals.signal import Array
from codriver.simulate import ROAD_TEST_STRETCHES, Stretch
from codriver.simulate.compare import shifting
from codriver.simulate.judge import at, rms

COLUMNS = ("ramp_and_bend", "uphill", "straight")
_TITLES = {
    "ramp_and_bend": "Figure 6, left: part of figure 4 (boxes 1 and 2)",
    "uphill": "Figure 6, middle: a short uphill segment",
    "straight": "Figure 6, right: a slightly inclined straight",
}


def alternatives_chapter(driven: Driven, intent: Estimate, kinematic: Estimate, pedals: Estimate) -> Chapter:
    """Figure 6, at ell = 2; all three estimates on the same ticks."""
    parts = {name: _part(name, driven, intent) for name in COLUMNS}
    charts = tuple(_chart(name, driven, intent, kinematic, pedals, part) for name, part in parts.items())
    items = (
        *_left(driven, intent, kinematic, parts["ramp_and_bend"]),
        *_uphill(driven, intent, kinematic, pedals, parts["uphill"]),
        *_straight(driven, intent, kinematic, parts["straight"]),
    )
    words = (
        "Two other ways to the same quantity: the kinematic model (eq. 22), the same observer without the known input, and "
        "the pedals alone (eq. 23), differentiated with a corner of 2 Hz.",
    )
    return Chapter("Comparison with other solutions (IV-C)", words, charts, items)


def _part(name: str, driven: Driven, intent: Estimate) -> Window:
    places = ROAD_TEST_STRETCHES
    place = Stretch(places["ramp"].start, places["bend"].stop, "") if name == "ramp_and_bend" else places[name]
    return window_in(intent, driven.truth, place.start, place.stop)


def _chart(
    name: str, driven: Driven, intent: Estimate, kinematic: Estimate, pedals: Estimate, part: Window
) -> Chart:  # fmt: skip
    log = driven.log
    start, stop = float(intent.time[part.first]), float(intent.time[part.last])

    def slope(words: str, estimate: Estimate, color: str) -> Curve:
        values = np.where(part(estimate.valid), slope_percent(part(estimate.columns["acceleration_offset"])), np.nan)
        return Curve(words, part(estimate.time), values, color)

    true = np.interp(part(intent.time), driven.truth["road_slope"].time, driven.truth["road_slope"].values)
    return Chart(
        _TITLES[name], "time (s)",
        (
            Plot("speed (km/h)", (measured("measured", log, "longitudinal_speed", start, stop, BLACK),
                                  curve("intention", intent, "longitudinal_speed", part, BLUE),
                                  curve("kinematic", kinematic, "longitudinal_speed", part, TURQUOISE, 1.0)), 120),
            Plot("accelerator (%)", (measured("p_r", log, "accelerator_pedal", start, stop, PURPLE),
                                     measured("p_b (right)", log, "brake_pressure", start, stop, GREEN, right=True)),
                 110, right_label="bar"),
            Plot("acceleration (m/s²)", (measured("accelerometer", log, "longitudinal_acceleration", start, stop, faint=True),
                                         curve("intention", intent, "intentional_acceleration", part, BLUE),
                                         curve("kinematic", kinematic, "longitudinal_acceleration", part, TURQUOISE),
                                         curve("pedals", pedals, "intentional_acceleration", part, PURPLE, 1.0)),
                 190, (0.0,)),
            Plot("slope (%)", (slope("intention", intent, BLUE), slope("kinematic", kinematic, TURQUOISE),
                               Curve("true", part(intent.time), 100 * np.tan(true), BLACK, dash="dot", width=1.2)), 120, (0.0,)),
            Plot("jerk (m/s³)", (curve("intention", intent, "intentional_jerk", part, BLUE),
                                 curve("kinematic", kinematic, "longitudinal_jerk", part, TURQUOISE),
                                 curve("pedals", pedals, "intentional_jerk", part, PURPLE, 1.0)), 200, (0.0,)),
        ),
        "", shades(intent, part),
    )  # fmt: skip


def _left(
    driven: Driven, intent: Estimate, kinematic: Estimate, part: Window
) -> tuple[Item, ...]:  # fmt: skip
    use = intent.valid & kinematic.valid
    calm = part(use & ~shifting(driven.truth, intent.time))
    ours, other = part(intent.columns["intentional_jerk"]), part(kinematic.columns["longitudinal_jerk"])
    alike = float(np.corrcoef(ours[calm], other[calm])[0, 1])
    lag = {s.estimator: s.lag for s in driven.scores if s.truth == "plan" and s.ell in (None, intent_ell(intent))}
    later = lag["intent-pedals"] - lag["pedals-only"]
    return (
        Item("fig. 6, left: our solution agrees with the kinematic model", "agreement", alike, "1", alike > 0.9,
             "correlation of the two jerks outside gear shifts; above 0.9 counts"),
        Item("fig. 6, left: our solution has a similar reactivity to change", "similar", later, "s", later < 0.2,
             f"how much later it is best correlated with the driver's plan than the pedal solution ({lag['pedals-only']:.2f} s), "
             "over the whole drive; below 0.2 s counts"),
    )  # fmt: skip


def intent_ell(estimate: Estimate) -> float:
    """The ell an estimate was made with."""
    return float(estimate.provenance["ell"])


def _uphill(
    driven: Driven, intent: Estimate, kinematic: Estimate, pedals: Estimate, part: Window
) -> tuple[Item, ...]:  # fmt: skip
    use = part(intent.valid & kinematic.valid)
    time = part(intent.time)
    true = at(driven.truth, "acceleration_offset", time)
    seen = [
        float(np.corrcoef(part(e.columns["acceleration_offset"])[use], true[use])[0, 1]) for e in (intent, kinematic)
    ]
    steeper = use & (np.gradient(true, time) > 0.1) & ~shifting(driven.truth, time)
    ours, by_pedals = part(intent.columns["intentional_jerk"]), part(pedals.columns["intentional_jerk"])
    meant = at(driven.truth, "intentional_jerk", time)
    shift = use & shifting(driven.truth, time)
    return (
        Item("fig. 6, middle: the slope shows in the offset of both formulations", "well witnessed",
             f"{seen[0]:.2f} and {seen[1]:.2f}", "", min(seen) > 0.8,
             "correlation of the estimated with the true offset, intention and kinematic; above 0.8 counts"),
        Item("fig. 6, middle: while it grows steeper the intentional jerk is small and negative", "small and negative",
             _mean(ours, steeper), "m/s³", -0.6 < _mean(ours, steeper) < 0.0,
             f"mean of the estimate where the slope grows; true intention {number(_mean(meant, steeper))}, pedals alone "
             f"{number(_mean(by_pedals, steeper))} m/s³"),
        Item("fig. 6, middle: our solution conforms better than the pedals", "better",
             f"{rms((ours - meant)[steeper]):.2f} against {rms((by_pedals - meant)[steeper]):.2f} m/s³", "",
             rms((ours - meant)[steeper]) < rms((by_pedals - meant)[steeper]),
             "rms error against the model's intention; shifts left out. Ours lags, the pedals do not"),
        _kinematic_in_shifts("fig. 6, middle: the kinematic model suffers from the gear shift", intent, kinematic, part, shift),
    )  # fmt: skip


def _straight(driven: Driven, intent: Estimate, kinematic: Estimate, part: Window) -> tuple[Item, ...]:
    shift = part(intent.valid & kinematic.valid) & shifting(driven.truth, part(intent.time))
    return (
        _kinematic_in_shifts(
            "fig. 6, right: gear shifts give the kinematic model bursts of jerk that are no intention",
            intent, kinematic, part, shift,
        ),
    )  # fmt: skip


def _kinematic_in_shifts(
    what: str, intent: Estimate, kinematic: Estimate, part: Window, shift: np.ndarray
) -> Item:  # fmt: skip
    """The greatest jerk in shifts, kinematic and ours."""
    if not shift.any():
        return Item(what, "bursts", "no gear shift there", "", None, "this driver did not shift in this stretch")
    ours, theirs = (
        _peak(part(e.columns[n])[shift]) for e, n in ((intent, "intentional_jerk"), (kinematic, "longitudinal_jerk"))
    )
    return Item(what, "bursts", f"{theirs:.1f} against {ours:.1f} m/s³", "", theirs > 1.5 * ours,
                "greatest jerk in shifts and the second after, kinematic against ours; 1.5 times counts")  # fmt: skip


def _peak(x: Array) -> float:
    return float(np.max(np.abs(x), initial=0.0))


def _mean(x: Array, mask: np.ndarray) -> float:
    return float(np.mean(x[mask])) if mask.any() else float("nan")
