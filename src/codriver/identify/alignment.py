"""A car's alignment map from drives with a measured torque in the column.

    T_dr = T_c z + b_s omega_s - T_aln(delta_s, v, the road so far)                                  see `models.alignment`

Drives that tell a coefficient have curves (k_a, T_s), at several speeds (the bank, e_max and q: a curve taken faster and slower
than it is made for), and small corrections (T_c, w, b_s). What they do not tell is refused and held at a usual car's value.

A constant error of the angle's zero looks like T_0 at any one speed and is not fitted: on drives left out it did harm as often as
good (alignment.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.finding import Finding
from codriver.identify.alignment_drive import (
    MOTOR,
    TORQUE,
    TORQUES,
    TURNS,
    Drive,
    alignment_drive,
    other_unit,
    refuse_sign,
)
from codriver.identify.alignment_fit import LETTERS, NO_BEND, WHOLE, fit_told, modelled
from codriver.identify.alignment_holdout import HoldOut, hold_out
from codriver.identify.alignment_result import AlignmentFit, coefficients_of
from codriver.identify.brake_fit import Refusal
from codriver.identify.plausible import within_file_bounds
from codriver.identify.regression import rms
from codriver.models.alignment import USUAL, AlignmentModel
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

GEOMETRY = ("steering_ratio", "wheelbase", "characteristic_speed")
LEAST_TURNING = 10.0  # s
MOST_LEAD = 0.2  # s
CURVES = "the drives hold too few curves, at too few speeds, to tell it from the others"
WHY = {
    "T_s": "the curves are too gentle to tell where the assist bends the map",
    "e_max": CURVES, "q": CURVES,
    "b_s": "the wheel moves too little to tell damping from friction",
    "T_c": "the wheel moves too little to tell friction",
    "w": "the wheel turns back too seldom to tell how friction builds up",
}  # fmt: skip


def identify_alignment(
    logs: Sequence[Log], vehicle: Vehicle | None = None, *, rate: float | None = None, by: str = TORQUE
) -> AlignmentFit:
    """The map and how far it can be trusted.

    Args:
        logs: drives with steering_wheel_angle, longitudinal_speed and the torque that turns the wheel.
        vehicle: steering_ratio, wheelbase and characteristic_speed, where it has them.
        rate: ticks per second; by default that of each drive's quicker signal, at most 50.
        by: that torque. steering_wheel_torque or driver_torque, of a sensor: the map is what hands feel, the assist's share
            taken off. steering_motor_torque, of drives without hands: the map is the whole load on the column.

    Raises:
        UsageError: no such torque.
        MissingSignal: a signal is missing.
        LogError: a drive is too short, in other units, of the other sign, or goes straight on.
    """
    if by not in TORQUES:
        raise UsageError(f"the torque '{by}'", f"one of {', '.join(TORQUES)}", "choose one")
    if not logs:
        raise LogError("no drive", "at least one", "give recordings with a measured torque")
    assumed = {name: USUAL[name] for name in GEOMETRY if vehicle is None or name not in vehicle}
    own: dict[str, Any] = {
        name: vehicle.number(name) if vehicle is not None and name in vehicle else USUAL[name] for name in GEOMETRY
    }
    whole = by == MOTOR
    letters = WHOLE if whole else tuple(LETTERS)
    if whole:
        own["bend"] = NO_BEND
    start = AlignmentModel(USUAL["alignment_gain"], **own)
    drives = [alignment_drive(log, start, rate, by) for log in logs]
    source = ", ".join(Path(d.source).name or f"drive {k + 1}" for k, d in enumerate(drives))
    refuse_sign(drives)
    _refuse_straight(drives, source, start)
    fit, lost = fit_told([(d, d.keep) for d in drives], start, letters)
    if "k_a" in lost:
        raise LogError(
            f"{source}: torque does not follow the curves", "curves in which the torque rises with lateral acceleration",
            f"check that {by} is the torque that turns the wheel, its clock that of the angle, and the units of angle and speed",
        )  # fmt: skip
    coefficients = coefficients_of(fit)
    for letter, found in coefficients.items():
        within_file_bounds(LETTERS[letter][1], [found.value], "a unit or scale of angle, speed or torque")
    answers = tuple(modelled(d, fit.model) for d in drives)
    left = np.concatenate([(d.torque - a)[d.keep] for d, a in zip(drives, answers, strict=True)])
    measured = np.concatenate([d.torque[d.keep] for d in drives])
    held, lead = hold_out(drives, start, letters), _lead(drives, answers)
    refused = tuple(
        Refusal(letter, WHY.get(letter, "the drives are too alike to tell it")) for letter in LETTERS if letter in lost
    )
    return AlignmentFit(
        coefficients, refused, fit.model, held, rms(left), 1 - float(np.mean(left**2) / np.var(measured)), lead, tuple(drives),
        answers, tuple(_findings(held, lead, refused, assumed)), assumed, source, by,
    )  # fmt: skip


def _refuse_straight(drives: Sequence[Drive], source: str, model: AlignmentModel) -> None:
    """Raises: LogError: there are hardly any curves, or they are in another unit."""
    turning = sum(float((d.keep & (np.abs(d.lateral) > TURNS)).sum()) * d.dt for d in drives)
    if turning < LEAST_TURNING:
        raise LogError(
            f"{source}: {turning:.1f} s of curves with more than {TURNS:g} m/s^2", f"at least {LEAST_TURNING:g} s, by far",
            other_unit(drives, model, LEAST_TURNING) or "record drives with curves; a straight road tells friction alone",
        )  # fmt: skip


def _lead(drives: Sequence[Drive], answers: Sequence[Array]) -> float:
    """The shift of the map's answer back in time with the least error of changes over a second, s."""
    step = max(d.dt for d in drives)
    shifts = np.arange(0, round(MOST_LEAD / step) + 1) * step
    sums = []
    for shift in shifts:
        total = 0.0
        for d, answer in zip(drives, answers, strict=True):
            e = d.torque - np.interp(d.time + shift, d.time, answer)
            n = max(round(1.0 / d.dt), 1)
            change = (e[n:] - e[:-n])[d.keep[n:] & d.keep[:-n]]
            total += float(np.sum(change**2)) * d.dt
        sums.append(total)
    return float(shifts[int(np.argmin(sums))])


def _findings(held: HoldOut, lead: float, refused: Sequence[Refusal], assumed: dict[str, float]) -> list[Finding]:
    """What is to say."""
    said = []
    if held.whole is None:
        said.append(
            Finding(
                "warn", "the drive is too short to leave anything out: how far the map is wrong elsewhere is not known"
            )
        )
    else:
        ours, theirs = held.whole.rmse["map"], held.whole.rmse["regression"]
        better = ours <= 1.02 * theirs
        text = (
            f"on {'drives' if held.by_drive else 'blocks'} left out the map is {ours:.3f} N m off (R2 {held.whole.r2['map']:.2f}), "
            f"a regression of nine features {theirs:.3f}, the mean {held.whole.rmse['mean']:.3f}"
        )
        said.append(Finding("ok" if better else "warn", text))
        if ours > 0.9 * held.whole.rmse["mean"]:
            said.append(Finding("bad", "the map is hardly better than answering the mean: do not use it"))
        if not held.by_drive:
            said.append(
                Finding("warn", "one drive alone: roads, tyres and the sensor's zero of another day were not tried")
            )
    for r in refused:
        said.append(Finding("warn", f"{r.name} is not told: {r.reason}; a usual car's value stands in"))
    if lead >= 0.04:
        said.append(
            Finding("warn", f"the torque is {1000 * lead:.0f} ms ahead of the angle: the angle comes late on the bus")
        )
    if assumed:
        usual = ", ".join(f"{name} {value:g}" for name, value in assumed.items())
        said.append(
            Finding(
                "warn",
                f"the vehicle lacks {', '.join(assumed)}: {usual} assumed; k_a goes with them",
            )
        )
    return said
