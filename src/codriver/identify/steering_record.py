"""A recording of a wheel that its motor turns, on ticks: which torque, and what is wrong with the angle.

    T(t_k) = torque_scale T_com + torque_offset, where the log holds a command;     delta unwrapped, spikes left out

* A step of the angle by 2 pi, give or take a tenth, that no wheel makes in a sample is a wrap, and is taken out.
* A sample that both neighbours contradict is a spike, and counts for nothing.
* A step that no wheel makes and that is no wrap is a jump of the encoder: the filter starts anew behind it.
* An angle that rests exactly at its greatest or least value is taken for saturated, or stopped: nothing counts there.
* A torque that is missing or too old stops the filter, which starts anew when it is back.

Each is told. Smaller jumps and softer end stops show in the fit: see `steering_model`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from codriver.errors import LogError, MissingSignal
from codriver.finding import Finding
from codriver.identify.steering_likelihood import Rows
from codriver.observers.feed import suggest_rate
from codriver.signals import Log, Signal
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

ANGLE = "steering_wheel_angle"
TORQUES = ("steering_motor_torque", "steering_motor_command", "alignment_torque")
FASTEST = 40.0  # rad/s; no hand and no motor is quicker
SLOWEST_RATE = 15.0  # Hz
LEAST_SECONDS = 3.0
RESTS = 0.05  # s
SPIKE = 8.0  # times the robust spread of the second difference
LEAST_SPIKE = pi / 180


@dataclass(frozen=True, eq=False)
class Record:
    """A recording on ticks.

    Attributes:
        rows: as the likelihood takes them.
        torque_from: what the torque is, for people.
        findings: what was wrong with it and could be mended.
        source: of the log.
        scale_error: standard error of the torque's scale, as a share.
    """

    rows: Rows
    torque_from: str
    findings: tuple[Finding, ...]
    source: str
    scale_error: float = 0.0


def steering_record(
    log: Log, vehicle: Vehicle | None = None, *, torques: Sequence[str] = (), rate: float | None = None, form: str = "exact"
) -> Record:  # fmt: skip
    """Take a recording.

    Args:
        log: with steering_wheel_angle and a torque.
        vehicle: has torque_scale where the log holds a command only.
        torques: standard names whose sum turns the wheel; by default the first there is of motor torque, motor command and
            alignment torque.
        rate: ticks per second; by default that of the quicker signal.
        form: of the tick, "exact" or "euler".

    Raises:
        MissingSignal: there is no angle or no torque.
        VehicleError: a command, and no torque_scale.
        LogError: the recording is too short, too slow, or its angle does not move.
    """
    name = log.source or "this log"
    chosen = list(torques) or [next((t for t in TORQUES if t in log), "")]
    if ANGLE not in log or any(t not in log for t in chosen):
        lacking = [n for n in (ANGLE, *(t or " or ".join(TORQUES) for t in chosen)) if n not in log]
        raise MissingSignal(
            f"{name} lacks {', '.join(lacking)}", "the wheel's angle, and the torque of the motor that turns it",
            "map them in a names file; `codriver info LOG` lists the channels",
        )  # fmt: skip
    angle, jumps, findings = mend_angle(log[ANGLE])
    if angle.duration < LEAST_SECONDS or angle.rate < SLOWEST_RATE:
        raise LogError(
            f"{name}: an angle of {angle.duration:.1f} s at {angle.rate:.3g} Hz",
            f"at least {LEAST_SECONDS:g} s at {SLOWEST_RATE:g} Hz: a wheel answers within some 0.2 s",
            "record longer, or quicker",
        )  # fmt: skip
    dt = 1.0 / (rate or suggest_rate(log, [ANGLE, *chosen]))
    grid = log.with_signals(angle).sample([ANGLE, *chosen], dt, start=float(angle.time[0]), stop=float(angle.time[-1]))
    torque = np.zeros(len(grid))
    known: Flags = np.ones(len(grid), bool)
    for t in chosen:
        scale, offset = (1.0, 0.0) if t != "steering_motor_command" else _scale(vehicle)
        torque += scale * grid.values[t] + offset
        known &= grid.held[t]
    reset = ~known
    if jumps.size:
        reset[np.clip(np.searchsorted(grid.time, jumps - 2e-6), 0, len(grid) - 1)] = True
    end = at_the_end(grid.values[ANGLE], dt)
    reset |= end
    if (part := float(end.mean())) > 0.02:
        findings.append(
            Finding(
                "warn",
                f"the angle rests at its greatest or least value for {part:.0%} of the time: saturated, or stopped; left out",
            )
        )
    rows = Rows(dt, grid.time, np.where(known, torque, 0.0), grid.values[ANGLE], grid.fresh[ANGLE], reset, form)
    if (lost := float((reset & ~end).mean())) > 0.01:
        findings.append(Finding("warn", f"{lost:.1%} of the recording is left out: torque missing or encoder jumps"))
    _refuse_still(rows, name)
    scale_error = _scale_error(vehicle) if "steering_motor_command" in chosen else 0.0
    return Record(rows, " + ".join(chosen), tuple(findings), log.source, scale_error)


def mend_angle(signal: Signal) -> tuple[Signal, Array, list[Finding]]:
    """The angle without wraps and spikes, the stamps of the encoder's jumps, and what to say about it."""
    finite = np.isfinite(signal.values)
    time, angle = signal.time[finite], signal.values[finite].copy()
    if angle.size < 5:
        return Signal(signal.name, time, angle, signal.unit, signal.source), np.empty(0), []
    found: list[Finding] = []
    turns = _turns(time, angle)
    if turns.any():
        angle += 2 * pi * np.cumsum(np.r_[0, turns])
        found.append(Finding("warn", f"the angle wraps {int((turns != 0).sum())} times by a turn; taken out"))
    spikes = _spikes(angle)
    if spikes.any():
        found.append(Finding("warn", f"{int(spikes.sum())} single samples of the angle are spikes; left out"))
        time, angle = time[~spikes], angle[~spikes]
    step = np.abs(np.diff(angle)) > FASTEST * np.maximum(np.diff(time), 1e-3)
    if step.any():
        largest = float(np.abs(np.diff(angle)).max()) * 180 / pi
        found.append(
            Finding(
                "warn", f"the encoder jumps {int(step.sum())} times, by up to {largest:.3g} deg; started anew there"
            )
        )
    return Signal(signal.name, time, angle, signal.unit, signal.source), time[1:][step], found


def at_the_end(angle: Array, dt: float) -> Flags:
    """Ticks at which the angle rests exactly at its greatest or least value, for five ticks and RESTS or longer."""
    found = np.zeros(angle.size, bool)
    for value in (angle.max(), angle.min()):
        edges = np.flatnonzero(np.diff(np.r_[False, angle == value, False]))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            found[start:stop] |= stop - start >= max(5, RESTS / dt)
    return found


def _turns(time: Array, angle: Array) -> Array:
    """Turns to add at each step, shape (n - 1,)."""
    step = np.diff(angle)
    turns = -np.round(step / (2 * pi))
    wrap = (np.abs(step + 2 * pi * turns) < 0.1 * 2 * pi) & (np.abs(step) > FASTEST * np.diff(time))
    return np.where(wrap, turns, 0.0)


def _spikes(angle: Array) -> Flags:
    """Samples that both neighbours contradict in the same sense, far beyond how the angle bends otherwise."""
    up, down = angle[1:-1] - angle[:-2], angle[1:-1] - angle[2:]
    bend = np.abs(up + down)
    limit = max(SPIKE * 1.4826 * float(np.median(bend)), LEAST_SPIKE)
    alone = (np.minimum(np.abs(up), np.abs(down)) > limit) & (up * down > 0)
    # A turning point bends too; a spike's neighbours lie close together beside its height.
    alone &= np.abs(angle[2:] - angle[:-2]) < 0.5 * np.minimum(np.abs(up), np.abs(down))
    return np.asarray(np.r_[False, alone, False])


def _scale(vehicle: Vehicle | None) -> tuple[float, float]:
    """torque_scale and torque_offset."""
    from codriver.errors import VehicleError

    if vehicle is None or "torque_scale" not in vehicle:
        raise VehicleError(
            "the log holds the motor's command, in the device's own unit, and there is no torque_scale",
            "a vehicle file with torque_scale (and torque_offset)",
            "find it with `codriver identify torque-scale` (weights hung on the wheel), or map steering_motor_torque with a scale",
        )
    return vehicle.number("torque_scale"), vehicle.number("torque_offset") if "torque_offset" in vehicle else 0.0


def _scale_error(vehicle: Vehicle | None) -> float:
    """Standard error of torque_scale, as a share; 0 where nobody gave one."""
    if vehicle is None or "torque_scale" not in vehicle:
        return 0.0
    sd = vehicle.parameters["torque_scale"].sd
    return abs(float(sd) / vehicle.number("torque_scale")) if isinstance(sd, (int, float)) else 0.0


def _refuse_still(rows: Rows, name: str) -> None:
    """A wheel that nothing turns says nothing.

    Raises:
        LogError: see there.
    """
    used = rows.fresh & ~rows.reset
    if used.sum() * rows.dt < LEAST_SECONDS / 2:
        raise LogError(
            f"{name}: {used.sum() * rows.dt:.1f} s are usable; elsewhere the torque is missing or the angle rests at its end",
            f"at least {LEAST_SECONDS / 2:g} s", "check the stamps of both signals, and turn the wheel by less",
        )  # fmt: skip
    angle, torque = rows.angle[used], rows.torque[used]
    noise = float(np.median(np.abs(np.diff(angle)))) if angle.size else 0.0
    if np.ptp(angle) < max(10 * noise, 0.2 * pi / 180) and np.ptp(angle) < 2 * pi / 180:
        raise LogError(
            f"{name}: the wheel turns by {np.ptp(angle) * 180 / pi:.2g} deg in all", "a wheel that moves",
            "turn it by its motor: a chirp or a sine of some N m, hands off",
        )  # fmt: skip
    if not np.ptp(torque) > 0:
        raise LogError(
            f"{name}: the torque is {float(torque[0]):g} N m throughout; a wheel left to itself tells b_s / J_s alone",
            "a torque that changes", "turn the wheel by its motor: a chirp or a sine of some N m",
        )  # fmt: skip
