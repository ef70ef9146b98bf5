"""Iterated prediction: a one-step model drives a model of column and car, whose motion makes the next features.

    T_{k+1} = f(z_k)                                                          one step, dt s on
    J_s delta_s'' + b_s delta_s' + T_c sign(delta_s') = T + T_aln             T straight from T_k to T_{k+1}     2019 eq. (27)
    T_aln = K_aln / g_s (beta + l_f r / v - delta_s / g_s)                                                       (92)
    (beta, r): `SingleTrack.advance`          a_y = (Y_f + Y_r) / m           z_{k+1}: the newest values shifted in

delta_s, rad: angle of the wheel; beta, r: sideslip and yaw rate, rad, rad/s; v: speed, m/s; K_aln, N m/rad, positive.

What is assumed. The speed stays. The road is level, and known as far as features and steps together reach. Nothing but tyres and
hands turns the column: with a power steering, K_aln has to be what the hands feel. The motion starts from the measured values as
they are, noise included. Nothing tells the model that the car has left the path, unless its features do.

A rollout in which torque, angle, sideslip or yaw rate passes WIDE times the largest value of the training rows has diverged. The
value is held at that bound, so that errors stay finite, and the rollout is counted.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 5.3 and figure 11.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple, Self

import numpy as np

from codriver.drivers.learned.features import FeatureTable
from codriver.drivers.learned.learned_driver import LearnedDriver
from codriver.errors import UsageError
from codriver.models.single_track import SLOWEST, SingleTrack
from codriver.models.steering import tick_of
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

SUBSTEP = 0.01  # s, at most
WIDE = 2.0
NEEDED = ("steering_wheel_angle", "yaw_rate", "sideslip_angle", "longitudinal_speed")
_MOVED = (*NEEDED[:3], "lateral_acceleration")


class Motion(NamedTuple):
    """Of wheel and car: rad, rad/s, rad, rad/s; each of shape (n,)."""

    angle: Array
    rate: Array
    sideslip: Array
    yaw_rate: Array


@dataclass(frozen=True)
class ColumnAndCar:
    """What the torque moves.

    Attributes:
        track: the car in plan view.
        ratio: g_s.
        stiffness: K_aln, N m/rad, positive.
        inertia, damping, friction: J_s, b_s, T_c of the column; kg m^2, N m s/rad, N m.
    """

    track: SingleTrack
    ratio: float
    stiffness: float
    inertia: float
    damping: float
    friction: float = 0.0

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> Self:
        """A vehicle's; without steering_friction there is none.

        Raises:
            VehicleError: the vehicle lacks a parameter.
        """
        return cls(
            SingleTrack.from_vehicle(vehicle), vehicle.number("steering_ratio"), vehicle.number("alignment_stiffness"),
            vehicle.number("steering_inertia"), vehicle.number("steering_damping"),
            vehicle.number("steering_friction") if "steering_friction" in vehicle else 0.0,
        )  # fmt: skip

    def advance(self, motion: Motion, speed: Array, before: Array, after: Array, time: float) -> Motion:
        """The motion some time later.

        Args:
            motion: now.
            speed: m/s, shape (n,); it stays.
            before, after: torque now and then, N m, straight in between.
            time: s.
        """
        substeps = ceil(time / SUBSTEP - 1e-9)
        h = time / substeps
        wheel = tick_of(self.inertia, self.damping, h)
        v = np.maximum(speed, SLOWEST)
        angle, rate, sideslip, yaw_rate = motion
        for i in range(substeps):
            torque = before + (after - before) * ((i + 0.5) / substeps)
            slip = self.track.front_slip(sideslip, yaw_rate, angle / self.ratio, v)
            angle, rate = wheel.advance(angle, rate, torque - self.stiffness / self.ratio * slip, self.friction)
            sideslip, yaw_rate = self.track.advance(sideslip, yaw_rate, angle / self.ratio, v, h)
        return Motion(angle, rate, sideslip, yaw_rate)

    def lateral_acceleration(self, motion: Motion, speed: Array) -> Array:
        """a_y at the centre of mass, m/s^2."""
        v, car = np.maximum(speed, SLOWEST), self.track
        front = car.front_stiffness * car.front_slip(motion.sideslip, motion.yaw_rate, motion.angle / self.ratio, v)
        rear = car.rear_stiffness * (car.rear * motion.yaw_rate / v - motion.sideslip)
        return np.asarray((front + rear) / car.mass)


@dataclass(frozen=True, eq=False)
class Rollouts:
    """From each of n rows.

    Attributes:
        torque: after 1, 2, ... steps, N m, shape (n, steps).
        diverged: whether the rollout has passed a bound by then, shape (n, steps).
    """

    torque: Array
    diverged: Flags


def check_rollable(driver: LearnedDriver) -> None:
    """Whether a driver's model can be iterated.

    Raises:
        UsageError: it has a memory, looks more or less than a step ahead, smooths, or sees what nothing here foretells.
    """
    setting = driver.protocol.features
    past = {f.signal for f in driver.features if f.kind == "past"}
    foreign = past - {driver.target, "road_curvature", *_MOVED} | {
        f.signal for f in driver.features if f.kind == "slow" and f.signal != "longitudinal_speed"
    }
    for bad, found, expected in (
        (driver.regressor.has_memory, f"a driver of kind '{driver.kind}', which has a memory", "a kind without"),
        (setting.horizon != setting.dt, f"a horizon of {setting.horizon:g} s", f"one step, {setting.dt:g} s"),
        (bool(setting.current), "features of the moment that is foretold", "features of the past and the road ahead"),
        (setting.smoothing != "none", f"smoothing '{setting.smoothing}'", "none: the model's motion is not filtered"),
        (bool(foreign), f"features of {', '.join(sorted(foreign))}", f"of {', '.join(_MOVED)}, torque, speed and road only"),
    ):  # fmt: skip
        if bad:
            raise UsageError(
                f"{found}, to be iterated", expected, "learn another driver, or foretell each horizon directly"
            )


def roll_out(
    driver: LearnedDriver,
    table: FeatureTable,
    plant: ColumnAndCar,
    rates: Array,
    steps: int,
    bounds: Mapping[str, float],
) -> Rollouts:
    """Iterate a one-step driver from each row of a table.

    Args:
        driver: see `check_rollable`.
        table: rows with at least the driver's features and the road `steps - 1` steps further.
        plant: what the torque moves.
        rates: of the steering wheel at each row, rad/s, shape (n,).
        steps: how many.
        bounds: largest value that is believed, of the torque and each of NEEDED but the speed.

    Raises:
        UsageError: the driver cannot be iterated, or the table lacks a column.
    """
    check_rollable(driver)
    dt, history = driver.protocol.features.dt, driver.protocol.features.history
    columns = {(f.signal, round(f.when / dt)): k for k, f in enumerate(table.features)}
    lacking = [name for name in NEEDED if (name, 0) not in columns]
    if lacking:
        raise UsageError(
            f"features without {', '.join(lacking)}",
            f"{', '.join(NEEDED)} now, where the motion starts",
            "add the signals",
        )
    far = [round(f.when / dt) for f in driver.features if f.signal == "road_curvature"]
    reach = max(far) + steps - 1 if far else -1  # nothing of the road is asked for
    if any(("road_curvature", k) not in columns for k in range(reach + 1)):
        raise UsageError(
            f"{steps} steps with a road that is not known {reach * dt:g} s ahead",
            "the road as far as features and steps together reach",
            "make the table with a longer preview",
        )
    line = {
        name: [table.X[:, columns[name, -lag]] for lag in range(history)]
        for name in (driver.target, *_MOVED, "road_curvature") if (name, 0) in columns
    }  # fmt: skip
    speed = table.X[:, columns["longitudinal_speed", 0]]
    motion = Motion(line["steering_wheel_angle"][0], rates, line["sideslip_angle"][0], line["yaw_rate"][0])
    torque, diverged = np.empty((len(table), steps)), np.zeros((len(table), steps), dtype=bool)
    lost = np.zeros(len(table), dtype=bool)
    for step in range(steps):
        z = np.empty((len(table), len(driver.features)))
        for j, feature in enumerate(driver.features):
            if feature.kind == "preview":
                z[:, j] = table.X[:, columns["road_curvature", round(feature.when / dt) + step]]
            else:
                z[:, j] = speed if feature.kind == "slow" else line[feature.signal][-round(feature.when / dt)]
        made = driver.scaling.torque_mean + driver.scaling.torque_size * driver.regressor.predict(
            driver.scaling.features(z)
        )
        new, beyond = _bounded(made, bounds[driver.target])
        moved = plant.advance(motion, speed, line[driver.target][0], new, dt)
        angle, angle_beyond = _bounded(moved.angle, bounds["steering_wheel_angle"])
        sideslip, sideslip_beyond = _bounded(moved.sideslip, bounds["sideslip_angle"])
        yaw_rate, yaw_beyond = _bounded(moved.yaw_rate, bounds["yaw_rate"])
        lost = lost | beyond | angle_beyond | sideslip_beyond | yaw_beyond
        motion = Motion(angle, moved.rate, sideslip, yaw_rate)
        torque[:, step], diverged[:, step] = new, lost
        newest = {
            driver.target: new, "steering_wheel_angle": angle, "sideslip_angle": sideslip, "yaw_rate": yaw_rate,
            "lateral_acceleration": plant.lateral_acceleration(motion, speed),
        }  # fmt: skip
        if ("road_curvature", step + 1) in columns:
            newest["road_curvature"] = table.X[:, columns["road_curvature", step + 1]]
        line = {name: [newest.get(name, old[0]), *old[:-1]] for name, old in line.items()}
    return Rollouts(torque, diverged)


def wheel_rates(log: Log, time: Array, tick: float) -> Array:
    """Rate of the steering wheel at moments of a drive, rad/s: as logged, or the slope of a parabola through the last three ticks.

    Args:
        log: the drive.
        time: s, on the ticks of the log, shape (n,).
        tick: s.
    """
    name = "steering_wheel_rate" if "steering_wheel_rate" in log else "steering_wheel_angle"
    # On the ticks of these moments, whatever the wheel's own first stamp.
    grid = log.sample([name], tick, start=float(time.min()) - 2 * tick, stop=float(time.max()) + tick / 2)
    values = np.where(grid.held[name], grid.values[name], np.nan)
    now = np.round((time - grid.time[0]) / tick).astype(int)
    if name == "steering_wheel_rate":
        return np.asarray(values[now])
    # A drive that has just begun, or a hole: fewer points, at last none.
    late, early = values[now] - values[now - 1], values[now - 1] - values[now - 2]
    late = np.nan_to_num(late)
    return np.asarray((1.5 * late - 0.5 * np.where(np.isfinite(early), early, late)) / tick)


def _bounded(values: Array, bound: float) -> tuple[Array, Flags]:
    """Values held within a bound, 0 for what is no number, and where that was needed."""
    beyond = ~(np.abs(values) <= bound)
    return np.clip(np.nan_to_num(values, nan=0.0, posinf=bound, neginf=-bound), -bound, bound), beyond
