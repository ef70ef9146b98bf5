"""Panels of a driver's steering torque: torque with band and sensor, hands, what else acts on the column, the angle reproduced.

The last is figure 10 of Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems).
"""

from __future__ import annotations

import numpy as np

from codriver.estimate import Estimate
from codriver.measured_torque import RESTART, SENSORS, on_ticks, reproduce_angle
from codriver.observers import ESTIMATORS
from codriver.report.parts import Band, Line, Panel
from codriver.report.shown import number, shown, shown_unit
from codriver.signals.signal import Array

ORANGE, GREEN, GREY, BLACK = "#E69F00", "#007A5A", "#757575", "#1a1a1a"
DRAWN = ("driver_torque", "steering_wheel_angle", "steering_wheel_rate", "hands_on")


def of_our_own(estimate: Estimate) -> bool:
    """Whether it is of one of our estimators of the driver's torque; others have the panels of any estimate."""
    return "driver_torque" in estimate and ("column_torque" in estimate.columns or estimate.observer in ESTIMATORS)


def torque_panels(estimate: Estimate, curves: list[Line | Band], truth: list[Line]) -> list[Panel]:
    """The panels, from the top; none for an estimate of something else.

    Args:
        estimate: with driver_torque.
        curves: the estimated torque, with its band.
        truth: the true torque, where it is known.
    """
    if not of_our_own(estimate):
        return []
    panels = [_torque(estimate, curves, truth), _hands(estimate), _column(estimate), _angle(estimate)]
    return [panel for panel in panels if panel is not None]


def _torque(estimate: Estimate, curves: list[Line | Band], truth: list[Line]) -> Panel:
    items: list[Line | Band] = []
    sensor = next((s for s in SENSORS if s in estimate.log and len(estimate.log[s])), None)
    if sensor is not None:
        items.append(Line("measured by a sensor", on_ticks(estimate, sensor), ORANGE, 1.2))
    title = "Driver's torque on the steering wheel, positive to the left"
    return Panel(title, "N m", 240, (*items, *curves, *truth), estimate.valid)


def _hands(estimate: Estimate) -> Panel | None:
    if "hands_on" not in estimate:
        return None
    values = shown("hands_on", np.where(estimate.valid, estimate.columns["hands_on"], np.nan))
    line = Line("probability", values, GREEN, 1.4, legend=False)
    title = "Probability that hands are on the wheel"
    return Panel(title, shown_unit("hands_on"), 70, (line,), estimate.valid, guides=(0.0, 50.0, 100.0))


def _column(estimate: Estimate) -> Panel | None:
    if "column_torque" not in estimate.columns:
        return None
    known = estimate.flag("inputs_known")
    line = Line("column", np.where(known, estimate.columns["column_torque"], np.nan), BLACK, 1.2, legend=False)
    title = "What else acts on the column: tyres or motor, less friction"
    return Panel(title, "N m", 120, (line,), known)


def _angle(estimate: Estimate) -> Panel | None:
    name = "steering_wheel_angle"
    if name not in estimate.columns:
        return None
    turns = estimate.columns.get("angle_turns", np.zeros(len(estimate.grid)))
    measured = np.where(estimate.grid.held[name], estimate.grid.values[name] + turns, np.nan)
    items: list[Line | Band] = [Line("measured", _shown(measured), GREY, 1.8)]
    title = "Angle of the wheel"
    made = reproduce_angle(estimate)
    if made is not None:
        items.append(Line("from the torques alone", _shown(made.angle), "#C84C00", 1.2, reference=True))
        off = number(float(_shown(np.array([made.rmse]))[0]))
        title += (
            f", and as the torques alone turn it, begun anew every {RESTART:g} s: {off}{shown_unit(name)} apart (RMS)"
        )
    return Panel(title, shown_unit(name), 170, tuple(items), np.isfinite(measured))


def _shown(values: Array) -> Array:
    return shown("steering_wheel_angle", values)
