"""What a log shows against an estimate of the driver's steering torque, beside its innovations.

Innovations say whether the angle moves as the filter expects. They say nothing of the known torque where the driver bears it, and
little where he does not: whatever is wrong with it is taken for the driver's. So these are looked at:

* the encoder: jumps, wraps, end stops, rests at an extreme value, an angle that never moves;
* the known torque: one that never changes; one that goes with the angle, where tyres and force feedback go against it (a wrong
  sign, or an assist motor without the tyres); one that scatters, or comes so rarely that it is too old, by more than the band;
* the driver's torque: more than hands give.

A known torque of a wrong scale shows nowhere, nor does one that comes late; that is said.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from codriver.finding import Finding
from codriver.signals import Grid, Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

ENCODER = "steering_wheel_angle"
KNOWN = ("alignment_torque", "steering_motor_torque", "steering_motor_command")
STILL = 0.5 * np.pi / 180  # rad; a wheel that moves by less in all
LEAST_SECONDS = 20.0  # of valid time, for signs and sizes
WITH, SURELY_WITH = 0.3, 0.6  # correlation of known torque and angle
STRONG, TOO_STRONG = 8.0, 15.0  # N m, rms of a driver's torque
FEW = 50
Values = Mapping[str, Array]


def steering_findings(values: Values, valid: Flags, grid: Grid, log: Log) -> list[Finding]:
    """Look at an estimate; nothing to say of estimates of something else.

    Args:
        values: columns of the observer's outputs.
        valid: where it is valid.
        grid: its sampled inputs.
        log: where it came from.
    """
    if "driver_torque" not in values or "inputs_known" not in values or ENCODER not in grid.values:
        return []
    return [*_encoder(values, grid), *_size(values, valid, grid), *_known_torque(values, valid, grid, log)]


def _encoder(values: Values, grid: Grid) -> list[Finding]:
    """What a steering wheel's encoder did that no wheel does."""
    findings = []
    fresh = grid.fresh[ENCODER]
    angle = grid.values[ENCODER][fresh]
    if angle.size >= FEW and np.ptp(angle) < STILL:
        findings.append(Finding(
            "bad", f"the angle moves by {np.ptp(angle) * 180 / np.pi:.2g} deg in all: a sensor that hangs, a wheel at rest",
        ))  # fmt: skip
    jumps = values.get("angle_jump", np.zeros(len(grid))) > 0.5
    if jumps.any():
        count = int(jumps.sum())
        share = count / max(angle.size, 1)
        findings.append(Finding(
            "bad" if share > 0.02 else "warn",
            f"the angle jumps {count} time{'s' * (count > 1)}: encoder, wrong samples, or blows; begun anew there"
            + ("; degrees taken for radians?" if share > 0.02 else ""), _spans(jumps, grid),
        ))  # fmt: skip
    if np.any(turns := values.get("angle_turns", np.zeros(1))):
        wraps = int((np.diff(turns) != 0).sum())
        findings.append(Finding("warn", f"the angle wraps {wraps} times by a turn; taken out"))
    stopped = values.get("at_end_stop", np.zeros(len(grid))) > 0.5
    if stopped.any():
        findings.append(Finding(
            "warn", f"the wheel is at its end stop for {stopped.mean():.1%} of the time: nobody knows what the stop bears",
            _spans(stopped, grid),
        ))  # fmt: skip
    rests = _rests_at_its_end(grid.values[ENCODER], fresh, grid.dt)
    if rests.any() and not stopped.any():
        findings.append(Finding(
            "warn", f"the angle rests exactly at its greatest or least value for {rests.sum() * grid.dt:.1f} s: a saturated sensor "
            "or an end stop? The torque there is not the driver's; set steering_end_stop in the vehicle file", _spans(rests, grid),
        ))  # fmt: skip
    return findings


def _size(values: Values, valid: Flags, grid: Grid) -> list[Finding]:
    """Whether hands give such a torque."""
    if valid.sum() * grid.dt < 1.0:
        return []
    size = float(np.sqrt(np.mean(values["driver_torque"][valid] ** 2)))
    if size < STRONG:
        return []
    return [Finding(
        "bad" if size > TOO_STRONG else "warn", f"the driver's torque is {size:.3g} N m rms, which hands do not give: unit or "
        "scale of the known torque, or the wheel's inertia or damping?",
    )]  # fmt: skip


def _known_torque(values: Values, valid: Flags, grid: Grid, log: Log) -> list[Finding]:
    """What is known to act on the column: whether it changes, its sign, its scatter and its age."""
    names = [n for n in KNOWN if n in grid.values and n in log]
    if not names or not valid.any():
        return []
    findings = []
    band = values.get("driver_torque_sd")
    sd = float(np.sqrt(np.mean(band[valid] ** 2))) if band is not None else np.inf
    for name in names:
        signal = log[name]
        there = np.isfinite(signal.values)
        known, stamps = signal.values[there], signal.time[there]
        if known.size < FEW:
            continue
        if not np.ptp(known) > 0:
            findings.append(Finding("bad", f"{name} is {known[0]:.4g} throughout: a channel that nothing feeds?"))
            continue
        scale = _scale(values, grid, name)
        scatter = scale * 1.4826 * float(np.median(np.abs(known[2:] - 2 * known[1:-1] + known[:-2]))) / np.sqrt(6)
        if scatter > sd:
            findings.append(Finding(
                "warn", f"{name} scatters by {scatter:.2g} N m from sample to sample; the band of {sd:.2g} N m takes it as given",
            ))  # fmt: skip
        every = float(np.median(np.diff(stamps)))
        step = scale * float(np.sqrt(np.mean(np.diff(known) ** 2))) / np.sqrt(3)
        if every > 2.5 * grid.dt and step > 0.7 * sd:
            findings.append(Finding(
                "warn", f"{name} comes every {every:.2g} s and is {step:.2g} N m old (rms), which the band of {sd:.2g} N m does "
                "not hold: log it more often",
            ))  # fmt: skip
    if "longitudinal_speed" not in grid.values:
        findings += _sign(values, valid, grid, names)
    findings.append(
        Finding("ok", f"{' and '.join(names)}: taken as given; a wrong scale or a delay would show nowhere")
    )
    return findings


def _sign(values: Values, valid: Flags, grid: Grid, names: list[str]) -> list[Finding]:
    """Tyres and force feedback turn the wheel back: their torque goes against the angle."""
    angle = grid.values[ENCODER] + values.get("angle_turns", 0.0)
    torque = values.get("column_torque", grid.values[names[0]])
    use = valid & np.isfinite(angle) & np.isfinite(torque)
    if use.sum() * grid.dt < LEAST_SECONDS or not (np.ptp(angle[use]) > 0 and np.ptp(torque[use]) > 0):
        return []
    r = float(np.corrcoef(angle[use], torque[use])[0, 1])
    if not r > WITH:
        return []
    what = " and ".join(names)
    cure = "a wrong sign of one of them?"
    if "steering_motor_torque" in names:
        cure = "a wrong sign; or an assist motor, which helps the driver: then the tyres are missing (codriver identify alignment)"
    return [Finding(
        "bad" if r > SURELY_WITH else "warn",
        f"{what} goes with the wheel's angle (correlation {r:.2f}), where tyres and force feedback go against it: {cure}",
    )]  # fmt: skip


def _scale(values: Values, grid: Grid, name: str) -> float:
    """N m per unit of a known input: 1, or the torque scale where it is a command."""
    if name != "steering_motor_command" or "column_torque" not in values:
        return 1.0
    command, torque = grid.values[name], values["column_torque"]
    use = np.isfinite(command) & np.isfinite(torque)
    spread = float(np.std(command[use])) if use.any() else 0.0
    return abs(float(np.cov(command[use], torque[use])[0, 1])) / spread**2 if spread > 0 else 1.0


def _rests_at_its_end(angle: Array, fresh: Flags, dt: float) -> Flags:
    """Ticks at which an angle rests at an extreme for half a second or more, away from where it mostly is; a second in all."""
    found = np.zeros(angle.size, bool)
    seen = angle[fresh]
    if seen.size < FEW or not np.ptp(seen) > 0:
        return found
    middle = float(np.median(seen))
    for end in (seen.max(), seen.min()):
        if abs(end - middle) < 0.25 * np.ptp(seen):
            continue
        edges = np.flatnonzero(np.diff(np.r_[0, (angle == end).astype(np.int8), 0]))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            found[a:b] |= (b - a) * dt >= 0.5
    return found if found.sum() * dt >= 1.0 else np.zeros(angle.size, bool)


def _spans(mask: Flags, grid: Grid) -> tuple[tuple[float, float], ...]:
    """Stretches of time where a mask holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return tuple(
        (float(grid.time[i]), float(grid.time[k - 1] + grid.dt)) for i, k in zip(edges[::2], edges[1::2], strict=True)
    )
