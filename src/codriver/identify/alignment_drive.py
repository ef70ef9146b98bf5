"""Drives with a measured column torque, on ticks: what the identification of the alignment map sees.

    omega_s = low-passed slope of the angle, 0.06 s, causal          kappa, kappa_r, v_r as `models.alignment` has them

Each drive has its own tick, that of its quicker signal, 20 to 50 Hz. Rows count while the car drives and all three signals are
fresh. A drive whose angle is in degrees, whose torque has the other sign, or that holds no torque is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from codriver.errors import LogError, MissingSignal
from codriver.models.alignment import AlignmentModel
from codriver.observers.feed import suggest_rate
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

ANGLE, SPEED, TORQUE = "steering_wheel_angle", "longitudinal_speed", "steering_wheel_torque"
MOTOR = "steering_motor_torque"
TORQUES = (TORQUE, "driver_torque", MOTOR)
FASTEST_RATE = 50.0  # Hz
RATE_TIME = 0.06  # s
SLOWEST = 1.0  # m/s
LEAST_SECONDS = 30.0
MOST_LATERAL = 12.0  # m/s^2, no car on a road has more
TURNS = 0.3  # m/s^2, from which on a car counts as cornering
MOST_SPEED = 60.0  # m/s, in nineteen parts of twenty
GAINS = (0.5, 5.0)  # N m per m/s^2, of a usual car's column
MOST_LOST = 0.05  # of a signal's samples; more without a number point to another unit


@dataclass(frozen=True, eq=False)
class Drive:
    """One drive.

    Attributes:
        source: of the log.
        dt: tick, s.
        time: shape (n,), s.
        angle, rate, speed, torque: rad, rad/s, m/s, N m.
        lateral: v^2 kappa of a steady turn, m/s^2.
        road_curvature, road_speed: of the road so far, 1/m and m/s.
        keep: rows that count.
    """

    source: str
    dt: float
    time: Array = field(repr=False)
    angle: Array = field(repr=False)
    rate: Array = field(repr=False)
    speed: Array = field(repr=False)
    torque: Array = field(repr=False)
    lateral: Array = field(repr=False)
    road_curvature: Array = field(repr=False)
    road_speed: Array = field(repr=False)
    keep: Flags = field(repr=False)

    @property
    def seconds(self) -> float:
        """Time that counts."""
        return float(self.keep.sum()) * self.dt

    def presliding(self, model: AlignmentModel) -> Array:
        """z along the drive, for the model's width, shape (n,)."""
        z, path = 0.0, np.empty(self.angle.size)
        share = np.diff(self.angle, prepend=self.angle[:1]) / model.width
        for k, x in enumerate(share.tolist()):
            z = (z + x) / (1.0 + abs(x))
            path[k] = z
        return path


def alignment_drive(log: Log, model: AlignmentModel, rate: float | None = None, by: str = TORQUE) -> Drive:
    """Take a drive.

    Args:
        log: with steering_wheel_angle, longitudinal_speed and the torque.
        model: steering ratio, wheelbase and characteristic speed count.
        rate: ticks per second; by default that of the quicker signal, at most FASTEST_RATE.
        by: standard name of the torque that turns the wheel.

    Raises:
        MissingSignal: a signal is missing.
        LogError: the drive is too short, or its angle or speed is in another unit.
    """
    name = log.source or "this log"
    signals = (ANGLE, SPEED, by)
    lacking = [n for n in signals if n not in log]
    if lacking:
        raise MissingSignal(
            f"{name} lacks {', '.join(lacking)}", "the wheel's angle, the speed, and the torque that turns it",
            "map them in a names file; `codriver info LOG` lists the channels",
        )  # fmt: skip
    dt = 1.0 / (rate or min(suggest_rate(log, signals), FASTEST_RATE))
    start = max(float(log[n].time[0]) for n in signals)
    stop = min(float(log[n].time[-1]) for n in signals)
    grid = log.sample(signals, dt, start=start, stop=max(stop, start))
    angle, speed, torque = (grid.values[n] for n in signals)
    keep = np.all([grid.held[n] & np.isfinite(grid.values[n]) for n in signals], axis=0) & (speed > SLOWEST)
    if keep.sum() * dt < LEAST_SECONDS:
        raise LogError(
            f"{name}: {keep.sum() * dt:.0f} s of driving with angle, speed and torque", f"at least {LEAST_SECONDS:g} s",
            _lost(log, signals) or "record a longer drive, with curves at several speeds",
        )  # fmt: skip
    angle, speed, torque = (_filled(x) for x in (angle, speed, torque))
    lateral = speed * speed * model.curvature(angle, speed)
    _refuse_units(name, speed[keep], lateral[keep])
    curvature, pace = _road(angle, speed, model, dt)
    return Drive(
        log.source, dt, grid.time, angle, _slope(angle, dt), speed, torque, lateral, curvature, pace, np.asarray(keep)
    )


def _lost(log: Log, names: Sequence[str]) -> str | None:
    """What is to do where samples of a signal are no numbers, as those out of its range become."""
    shares = {name: float(np.mean(~np.isfinite(log[name].values))) for name in names}
    name = max(shares, key=lambda n: shares[n])
    if shares[name] < MOST_LOST:
        return None
    unit = {ANGLE: "degrees", SPEED: "km/h"}.get(name)
    return (
        f"{shares[name]:.0%} of the samples of {name} are missing or out of range: check its unit in the names file"
        + (f"; it is likely {unit}" if unit else "")
    )


def other_unit(drives: Sequence[Drive], model: AlignmentModel, least: float) -> str | None:
    """What is to do where drives that look straight hold curves of an ordinary size, and an ordinary torque, in another unit.

    Args:
        drives: with less than `least` of curves.
        model: its geometry counts.
        least: s of curves that an ordinary drive has.
    """
    angle, speed, torque = (
        np.concatenate([getattr(d, n)[d.keep] for d in drives]) for n in ("angle", "speed", "torque")
    )
    seconds = np.concatenate([np.full(int(d.keep.sum()), d.dt) for d in drives])

    def ordinary(angle: Array, speed: Array) -> bool:
        lateral = speed * speed * model.curvature(angle, speed)
        if seconds[np.abs(lateral) > TURNS].sum() < least:
            return False
        # Friction and corrections on a straight road make a torque, too, but a small one for such curves.
        gain = np.cov(lateral, torque)[0, 1] / np.var(lateral)
        slow = np.percentile(speed, 95) <= MOST_SPEED and np.percentile(np.abs(lateral), 98) <= MOST_LATERAL
        return bool(slow and GAINS[0] < gain < GAINS[1])

    likely = []
    if ordinary(angle * 180 / np.pi, speed):
        likely.append("the angle is likely in rad where the names file says deg")
    if ordinary(angle, 3.6 * speed):
        likely.append("the speed is likely in m/s where the names file says km/h")
    return f"if the drives hold curves, {', or '.join(likely)}; if not, record some" if likely else None


def refuse_sign(drives: Sequence[Drive]) -> None:
    """Whether torque and angle have one sign in turns.

    Raises:
        LogError: they have opposite signs, or the torque rests.
    """
    for drive in drives:
        if not np.ptp(drive.torque[drive.keep]) > 0:
            raise LogError(
                f"{drive.source}: the torque is {float(drive.torque[drive.keep][0]):g} N m throughout",
                "a torque that turns the wheel", "check which channel is mapped to it",
            )  # fmt: skip
        turning = drive.keep & (np.abs(drive.lateral) > TURNS) & (drive.speed > 5.0)
        if turning.sum() * drive.dt < 5.0:
            continue
        r = float(np.corrcoef(drive.lateral[turning], drive.torque[turning])[0, 1])
        if r < -0.3:
            raise LogError(
                f"{drive.source}: angle and torque have opposite signs in turns (correlation {r:.2f})",
                "both positive to the left: who turns to the left pulls to the left",
                "give one of them a scale of -1 in the names file",
            )  # fmt: skip


def _refuse_units(name: str, speed: Array, lateral: Array) -> None:
    """Raises: LogError: speed or angle is in another unit."""
    if (fast := float(np.percentile(speed, 95))) > MOST_SPEED:
        raise LogError(
            f"{name}: a speed of {fast:.3g} m/s", f"at most {MOST_SPEED:g} m/s", "the unit is likely km/h: say so in the names file"
        )  # fmt: skip
    if (most := float(np.percentile(np.abs(lateral), 98))) > MOST_LATERAL:
        raise LogError(
            f"{name}: angle and speed make a lateral acceleration of {most:.3g} m/s^2", f"at most {MOST_LATERAL:g} m/s^2",
            "the angle is likely in degrees, or the speed in km/h: say so in the names file",
        )  # fmt: skip


def _filled(x: Array) -> Array:
    """The same with the last number where there is none."""
    good = np.isfinite(x)
    index = np.maximum.accumulate(np.where(good, np.arange(x.size), 0))
    filled = x[index]
    return np.where(np.isfinite(filled), filled, x[good][0] if good.any() else 0.0)


def _slope(angle: Array, dt: float) -> Array:
    """Low-passed slope."""
    from scipy.signal import lfilter

    share = 1 - np.exp(-dt / RATE_TIME)
    return np.asarray(lfilter([share], [1, share - 1], np.diff(angle, prepend=angle[:1]) / dt))


def _road(angle: Array, speed: Array, model: AlignmentModel, dt: float) -> tuple[Array, Array]:
    """The road's curvature and speed along the drive, tick by tick as the model has them."""
    states, path = dict(model.states), np.empty((angle.size, 2))
    for k, (a, v) in enumerate(zip(angle.tolist(), speed.tolist(), strict=True)):
        states = model.advance(states, a, v, dt)
        path[k] = states["road_curvature"], states["road_speed"]
    return path[:, 0], path[:, 1]
