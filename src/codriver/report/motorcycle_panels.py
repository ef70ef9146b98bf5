"""Panels of a motorcycle's estimate: lean, rider's torque, tyre forces, steer, turn, biases, and what is not as it should be.

Figures 3 to 11 of Damon, Ichalal, Arioui 2018 show the first five of these.
"""

from __future__ import annotations

import numpy as np

from codriver.estimate import Estimate
from codriver.report.parts import Band, Line, Panel
from codriver.report.shown import shown, shown_unit

BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#007A5A", "#C84C00", "#757575"
FORCES = (("front_lateral_force", "front", BLUE, "rgba(0,114,178,0.22)"),
          ("rear_lateral_force", "rear", RED, "rgba(200,76,0,0.18)"))  # fmt: skip
RATES = (
    ("roll_rate_bias", "roll rate", BLUE),
    ("pitch_rate_bias", "pitch rate", ORANGE),
    ("yaw_rate_bias", "yaw rate", RED),
)
ACCELERATIONS = (("lateral_acceleration_bias", "lateral", BLUE), ("vertical_acceleration_bias", "vertical", RED))
# What has a panel of its own here, or none.
DRAWN = (
    "roll_angle", "rider_torque", "steer_angle", "steer_rate", "roll_rate", "pitching", "roll_moment",
    *(name for name, *_ in (*FORCES, *RATES, *ACCELERATIONS)),
)  # fmt: skip
# Flags by name: what is said where they are as the number says, and the height of its line.
TOLD = (
    ("slow", 1, "so slow that feet may be down"), ("speed_in_range", 0, "speed out of range"),
    ("certified", 0, "speed out of range"), ("lean_in_range", 0, "leans more than a turn can be taken for"),
    ("measured", 0, "measurements missing"), ("valid", 0, "not valid"),
)  # fmt: skip
SIGMAS = 1.96


def of_a_motorcycle(estimate: Estimate) -> bool:
    """Whether it is of a motorcycle's lean."""
    return "roll_angle" in estimate


def motorcycle_panels(
    estimate: Estimate, roll: tuple[Line | Band, ...], torque: tuple[Line | Band, ...], steer: tuple[Line | Band, ...]
) -> list[Panel]:
    """The panels, from the top.

    Args:
        estimate: with roll_angle.
        roll, torque, steer: what is drawn of these, with bands and truth; nothing where the estimator has none.
    """
    made = [
        Panel(
            "Lean of the machine from the vertical, positive to the right",
            shown_unit("roll_angle"),
            240,
            roll,
            estimate.valid,
        ),
        Panel(
            "Torque of the rider on the handlebar, positive to the left",
            shown_unit("rider_torque"),
            200,
            torque,
            estimate.valid,
        )
        if torque
        else None,
        _forces(estimate),
        Panel("Steer angle, positive to the left", shown_unit("steer_angle"), 130, steer, estimate.valid)
        if steer
        else None,
        _moment(estimate),
        _biases(estimate, "Biases of the gyroscope", RATES, "roll_rate"),
        _biases(estimate, "Biases of the accelerometer", ACCELERATIONS, "lateral_acceleration"),
        _flags(estimate),
    ]
    return [panel for panel in made if panel is not None]


def _forces(estimate: Estimate) -> Panel | None:
    items: list[Line | Band] = []
    for name, legend, color, band in FORCES:
        if name not in estimate:
            continue
        value, sd = np.where(estimate.valid, estimate.columns[name], np.nan), estimate.sd(name)
        if sd is not None:
            items.append(Band(f"95% band, {legend}", value - SIGMAS * sd, value + SIGMAS * sd, band))
        items.append(Line(legend, value, color, 1.4))
    title = "Lateral forces of the tyres, positive to the left"
    return Panel(title, "N", 180, tuple(items), estimate.valid) if items else None


def _moment(estimate: Estimate) -> Panel | None:
    if "roll_moment" not in estimate:
        return None
    value, sd = np.where(estimate.valid, estimate.columns["roll_moment"], np.nan), estimate.sd("roll_moment")
    items: list[Line | Band] = [] if sd is None else [Band("95% band", value - SIGMAS * sd, value + SIGMAS * sd)]
    title = "Moment about the road that nothing else explains, to the right"
    return Panel(title, "N m", 90, (*items, Line("estimate", value, BLUE, 1.4)), estimate.valid)


def _biases(estimate: Estimate, title: str, biases: tuple[tuple[str, str, str], ...], like: str) -> Panel | None:
    there = [(name, legend, color) for name, legend, color in biases if name in estimate]
    if not there:
        return None
    lines = []
    for name, legend, color in there:
        lines.append(Line(legend, shown(like, np.where(estimate.valid, estimate.columns[name], np.nan)), color, 1.3))
    return Panel(title, shown_unit(like), 100, tuple(lines), estimate.valid)


def _flags(estimate: Estimate) -> Panel | None:
    """A line a flag that is raised anywhere."""
    lines: list[Line] = []
    for name, bad, legend in TOLD:
        if name not in estimate.columns:
            continue
        raised = estimate.flag(name) == bool(bad)
        if raised.any():
            height = float(len(lines) + 1)
            lines.append(
                Line(legend, np.where(raised, height, np.nan), (GREY, RED, ORANGE, GREEN, BLUE)[len(lines) % 5], 5.0)
            )
    if not lines:
        return None
    everywhere = np.ones(len(estimate.grid), bool)
    return Panel("Flags, where they are raised", "", 40 + 14 * len(lines), tuple(lines), everywhere, guides=())
