"""What is drawn, before anyone draws it: panels over one time axis, ordered as in figure 4 of the 2017 paper.

speed; pedals, or torques where there are no pedals; gear; acceleration and accelerometer; jerk; slope; innovations.
A panel appears only if the estimate or its log holds something for it, so each estimator gets the report it can fill.
What an estimator estimates beyond these stands above them, a panel each: the estimate with its band, and what was measured
or is true under the same name.

Colours follow those of Okabe and Ito, which people with any kind of colour vision tell apart.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from html import escape

import numpy as np
import numpy.typing as npt

from codriver.estimate import Estimate
from codriver.observers import Output
from codriver.report.motorcycle_panels import DRAWN as LEAN_DRAWN
from codriver.report.motorcycle_panels import motorcycle_panels, of_a_motorcycle
from codriver.report.parts import Band, Line, Panel
from codriver.report.shown import shown, shown_unit, words
from codriver.report.torque_panels import DRAWN, of_our_own, torque_panels
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.summary import measured_on_ticks

BLUE, ORANGE, GREEN, RED, BLACK, GREY = "#0072B2", "#E69F00", "#007A5A", "#C84C00", "#1a1a1a", "#757575"
PURPLE = "#8E2F86"
SIGMAS = 1.96  # half width of a 95% band in standard deviations
GRAVITY = 9.80665
# Estimates that the panels below draw in a way of their own.
SPECIAL = (
    "longitudinal_speed", "intentional_acceleration", "longitudinal_acceleration", "intentional_jerk",
    "longitudinal_jerk", "acceleration_offset",
)  # fmt: skip
# Innovations: what a row is called in the legend, and its colour; the colours of other rows.
ROWS = {"acceleration": ("accelerometer", ORANGE), "speed": ("speed", BLUE)}
OTHERS = (BLUE, ORANGE, GREEN, RED, PURPLE, BLACK)
MANY = 4  # rows whose legend leaves no place for a long title
HELD = 0.5  # s over which an innovation is drawn on


def panels(estimate: Estimate, truth: Log | None = None) -> list[Panel]:
    """The panels that this estimate can fill."""
    measured = _Measured(estimate)
    reference = _Truth(estimate, truth)
    torque = [] if not of_our_own(estimate) else torque_panels(
        estimate, _estimated(estimate, "driver_torque"), reference(("driver_torque", "true", "dot"))
    )  # fmt: skip
    lean = [] if not of_a_motorcycle(estimate) else motorcycle_panels(
        estimate, *(_compared(estimate, name, measured, reference) for name in ("roll_angle", "rider_torque", "steer_angle"))
    )  # fmt: skip
    special = (*SPECIAL, *(DRAWN if torque else ()), *(LEAN_DRAWN if lean else ()))
    made = [
        *torque,
        *lean,
        *(_plain(output, estimate, measured, reference) for output in estimate.estimates if output.name not in special),
        _speed(estimate, measured, reference),
        _pedals(estimate, measured),
        _torques(estimate, measured),
        _gear(estimate, measured),
        _acceleration(estimate, measured, reference),
        _jerk(estimate, reference),
        _slope(estimate, reference),
        _innovations(estimate),
    ]
    return [panel for panel in made if panel is not None]


class _Measured:
    """Signals of the log on the estimate's ticks, in display units, NaN where they are missing or too old."""

    def __init__(self, estimate: Estimate) -> None:
        self._estimate = estimate

    def __contains__(self, name: str) -> bool:
        return name in self._estimate.log and len(self._estimate.log[name]) > 0

    def __call__(self, name: str) -> Array:
        return shown(name, measured_on_ticks(self._estimate, name))


class _Truth:
    """Curves of the reference on the estimate's ticks."""

    def __init__(self, estimate: Estimate, truth: Log | None) -> None:
        self._time, self._truth = estimate.time, truth

    def __call__(self, *names: tuple[str, str, str]) -> list[Line]:
        """Lines for (name in the truth, legend, dash), where the truth has them."""
        lines = []
        for name, legend, dash in names:
            values = on_ticks(self._truth, name, self._time)
            if values is not None:
                color = PURPLE if dash == "dashdot" else BLACK
                lines.append(Line(legend, shown(name, values), color, 1.3, dash, reference=True))
        return lines


def on_ticks(log: Log | None, name: str, time: Array) -> Array | None:
    """A signal of a reference at the ticks, straight between its samples, NaN outside; None where there is none."""
    if log is None or name not in log:
        return None
    finite = np.isfinite(log[name].values)
    if not finite.any():
        return None
    return np.interp(time, log[name].time[finite], log[name].values[finite], left=np.nan, right=np.nan)


def _estimated(estimate: Estimate, name: str, shape: Callable[[Array], Array] | None = None) -> list[Line | Band]:
    """Band, the curve where it is valid, and in thin grey where it is not.

    Args:
        estimate: what is drawn.
        name: of the output.
        shape: from SI to what is shown; by default the display unit.
    """
    show = shape or partial(shown, name)
    raw, sd, valid = estimate.columns[name], estimate.sd(name), estimate.valid
    value = show(raw)
    items: list[Line | Band] = []
    if sd is not None:
        low, high = (np.where(valid, show(raw + k * SIGMAS * sd), np.nan) for k in (-1, 1))
        items.append(Band("95% band", low, high))
    if not valid.all():
        # The grey curve reaches one tick into the other, so that the two meet.
        inner = valid & np.roll(valid, 1) & np.roll(valid, -1)
        items.append(Line("estimate, not valid", np.where(inner, np.nan, value), "#9a9a9a", 1.0, legend=False))
    items.append(Line("estimate", np.where(valid, value, np.nan), BLUE, 1.6))
    return items


def _compared(estimate: Estimate, name: str, measured: _Measured, truth: _Truth) -> tuple[Line | Band, ...]:
    """An estimate beside what was measured and is true; nothing where it is not estimated."""
    if name not in estimate:
        return ()
    items: list[Line | Band] = [Line("measured", measured(name), GREY, 1.0)] if name in measured else []
    return (*items, *_estimated(estimate, name), *truth((name, "true", "dot")))


def _plain(output: Output, estimate: Estimate, measured: _Measured, truth: _Truth) -> Panel:
    """An estimate that has no panel of its own kind."""
    name = output.name
    items = _compared(estimate, name, measured, truth)
    # Titles may hold markup, and a meaning is somebody's text.
    title = escape(words(name).capitalize() + (f": {output.meaning}" if output.meaning else ""))
    return Panel(title, shown_unit(name, output.unit), 150, items, estimate.valid)


def _speed(estimate: Estimate, measured: _Measured, truth: _Truth) -> Panel | None:
    name = "longitudinal_speed"
    items: list[Line | Band] = []
    if name in measured:
        items.append(Line("measured", measured(name), GREY, 1.2))
    if name in estimate:
        items += _estimated(estimate, name)
    items += truth((name, "true", "dot"))
    return Panel("Speed", shown_unit(name), 130, tuple(items), _everywhere(estimate)) if items else None


def _pedals(estimate: Estimate, measured: _Measured) -> Panel | None:
    items: list[Line] = []
    if "accelerator_pedal" in measured:
        items.append(Line("accelerator (left)", measured("accelerator_pedal"), GREEN))
    if "brake_pressure" in measured:
        items.append(Line("brake pressure (right)", measured("brake_pressure"), RED, dash="dash", right=True))
    elif "brake_switch" in measured:
        items.append(Line("brake switch, 1 pressed (right)", measured("brake_switch"), RED, steps=True, right=True))
    if not items:
        return None
    right = "bar" if "brake_pressure" in measured else "on/off"
    return Panel("Pedals", "%", 120, tuple(items), _everywhere(estimate), right if items[-1].right else "")


def _torques(estimate: Estimate, measured: _Measured) -> Panel | None:
    if "accelerator_pedal" in measured and "engine_torque_request" not in estimate.grid.values:
        return None
    items = [
        Line(legend, measured(name), color, dash=dash)
        for name, legend, color, dash in (
            ("engine_torque_request", "requested by the driver", GREEN, "solid"),
            ("engine_torque", "actual", BLACK, "dash"),
        )
        if name in measured
    ]
    if not items:
        return None
    return Panel("Torque of engine or motor", shown_unit("engine_torque"), 120, tuple(items), _everywhere(estimate))


def _gear(estimate: Estimate, measured: _Measured) -> Panel | None:
    if "gear" not in measured:
        return None
    gear = measured("gear")
    if np.nanmin(gear, initial=9) == np.nanmax(gear, initial=-9):
        return None  # one gear all the time is told in the table of signals
    line = Line("gear", gear, BLACK, 1.4, steps=True, legend=False)
    return Panel("Gear", "", 58, (line,), _everywhere(estimate), guides=(), whole=True)


def _acceleration(estimate: Estimate, measured: _Measured, truth: _Truth) -> Panel | None:
    items: list[Line | Band] = []
    if "longitudinal_acceleration" in measured:
        items.append(Line("accelerometer, measured", measured("longitudinal_acceleration"), GREY, 0.9))
    title = "Acceleration"
    for name, what, planned in (
        ("intentional_acceleration", "Intentional acceleration: what the driver asks for", True),
        ("longitudinal_acceleration", "Acceleration of the vehicle, whoever caused it", False),
    ):
        if name in estimate:
            title = what
            items += _estimated(estimate, name)
            items += truth((name, "true", "dot"), *([_planned("planned_acceleration")] if planned else []))
    return Panel(title, "m/s²", 185, tuple(items), _everywhere(estimate)) if items else None


def _jerk(estimate: Estimate, truth: _Truth) -> Panel | None:
    items: list[Line | Band] = []
    title = "Jerk"
    for name, what, planned in (
        ("intentional_jerk", "Intentional jerk: how the driver changes what he or she asks for", True),
        ("longitudinal_jerk", "Jerk of the vehicle, whoever caused it", False),
    ):
        if name in estimate:
            title = what
            items += _estimated(estimate, name)
            items += truth((name, "true", "dot"), *([_planned("planned_jerk")] if planned else []))
    return Panel(title, "m/s³", 185, tuple(items), estimate.valid) if items else None


def _planned(name: str) -> tuple[str, str, str]:
    return name, "planned by the driver", "dashdot"


def _slope(estimate: Estimate, truth: _Truth) -> Panel | None:
    if "acceleration_offset" not in estimate:
        return None

    def slope(offset: Array) -> Array:
        # As the paper: tan(o_a / g) * 100. Offsets of 1 g and more are no slope; they are cut to keep tan finite.
        return 100.0 * np.tan(np.clip(offset / GRAVITY, -1.2, 1.2))

    items = _estimated(estimate, "acceleration_offset", slope)
    items += truth(("road_slope", "true", "dot"))
    return Panel("Road slope, with the accelerometer's bias in it", "%", 120, tuple(items), estimate.valid)


def _innovations(estimate: Estimate) -> Panel | None:
    items = []
    for number, row in enumerate(estimate.innovations):
        if row.sd is None or not row.used.any():
            continue
        legend, color = ROWS.get(row.row, (words(row.row), OTHERS[number % len(OTHERS)]))
        carried_on = _carried_on(row.normalised(np.nan), round(HELD / estimate.grid.dt))
        items.append(Line(legend, np.where(estimate.valid, carried_on, np.nan), color, 0.9))
    title = "Innovations: measured less predicted, in standard deviations (sd)" if len(items) < MANY else "Innovations"
    return Panel(title, "sd", 110, tuple(items), estimate.valid, guides=(-SIGMAS, SIGMAS)) if items else None


def _carried_on(values: Array, most: int) -> Array:
    """Each value carried on over the ticks without one, at most `most` of them."""
    index = np.where(np.isfinite(values), np.arange(values.size), -1)
    newest = np.maximum.accumulate(index) if values.size else index
    there = (newest >= 0) & (np.arange(values.size) - newest <= most)
    return np.where(there, values[np.maximum(newest, 0)] if values.size else values, np.nan)


def _everywhere(estimate: Estimate) -> npt.NDArray[np.bool_]:
    return np.ones(len(estimate.grid), bool)
