"""K_aln of eq. (92), from drives whose alignment torque is known: a simulator's log, or a car with a torque sensor.

    -T_aln = K_aln / g_s alpha + T_0                       alpha = delta_s / g_s - beta - l_f r / v       front slip angle, rad
    T_dr   = K_aln / g_s alpha + T_0 + b omega + T_c z     where the log has a torque sensor and no alignment torque

beta and r are the log's (sideslip_angle, yaw_rate) where it has both, else the single track's of the vehicle file, from speed and
angle. Least squares with outliers trimmed, standard errors for residuals that are alike from tick to tick (`regression`). K_aln is
positive; as printed, -K_p C_f n_t, it would push the wheel away from the middle. A tyre's trail shrinks with its slip, so the line
bends: it is told where a cubic term takes away a fifth of the torque at the largest slip angles.

Judged by halves: each fitted, and asked for the other. Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), eq. (92).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from codriver.errors import LogError, MissingSignal, VehicleError
from codriver.finding import Finding
from codriver.identify.regression import regress, rms, solve
from codriver.models.single_track import SLOWEST, SingleTrack
from codriver.observers.feed import suggest_rate
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

ANGLE, SPEED, ALIGNMENT, SENSOR = (
    "steering_wheel_angle", "longitudinal_speed", "alignment_torque", "steering_wheel_torque",
)  # fmt: skip
MOTION = ("sideslip_angle", "yaw_rate")
SLOW = 3.0  # m/s; below, l r / v is no angle that a tyre shows
LEAST_SECONDS, LEAST_SLIP = 20.0, 0.002  # s; rad (RMS)
SURE = 0.1  # greatest standard error, as a share of K_aln
BEND = 0.2  # of the torque at the largest slip angles, from which on a bend is told
WIDTH = 0.004  # rad, over which friction builds up


@dataclass(frozen=True, eq=False)
class StiffnessFit:
    """What was found.

    Attributes:
        stiffness: K_aln, N m/rad; sd its standard error; low, high its 95 % interval.
        offset: T_0, N m.
        rmse, r2: of the fit; held_rmse, held_r2: of each half by the other's fit.
        slip_from: where sideslip and yaw rate are from, for people.
        torque_from: the signal that told the torque.
        seconds: that count.
        findings: what is to say.
        slip, torque: of the rows that count, for the chart: rad, N m.
        source: of the logs.
    """

    stiffness: float
    sd: float
    low: float
    high: float
    offset: float
    rmse: float
    r2: float
    held_rmse: float
    held_r2: float
    slip_from: str
    torque_from: str
    seconds: float
    findings: tuple[Finding, ...]
    slip: Array = field(repr=False)
    torque: Array = field(repr=False)
    source: str = ""

    def vehicle(self, old: Vehicle) -> Vehicle:
        """The vehicle with alignment_stiffness and the error of the half left out."""
        text = f"identified from {self.source}, {self.seconds:.0f} s, by {self.torque_from}; slip angle of the {self.slip_from}"
        new = old.with_parameter("alignment_stiffness", self.stiffness, self.sd, text)
        return new.with_parameter("alignment_torque_sd", self.held_rmse, source=f"of the half left out, {text}")


def identify_alignment_stiffness(logs: Sequence[Log], vehicle: Vehicle) -> StiffnessFit:
    """K_aln by least squares.

    Args:
        logs: drives with steering_wheel_angle, longitudinal_speed, and alignment_torque or steering_wheel_torque.
        vehicle: with steering_ratio and front_axle_distance; with a whole single track where a log lacks sideslip or yaw rate.

    Raises:
        MissingSignal, VehicleError: something is missing.
        LogError: too little driving, no slip, another sign, or a standard error of more than a tenth.
    """
    parts = [_rows(log, vehicle) for log in logs]
    if not parts:
        raise LogError("no drive", "at least one", "give recordings")
    slip_from = " and ".join(dict.fromkeys(p.slip_from for p in parts))
    by = " and ".join(dict.fromkeys(p.by for p in parts))
    if len({p.X.shape[1] for p in parts}) > 1:
        raise LogError(f"drives with {by}", "one kind of torque in all of them", "give those with one of them")
    X, y = np.vstack([p.X for p in parts]), np.concatenate([p.y for p in parts])
    offered = np.concatenate([p.keep for p in parts])
    pieces = np.cumsum([0, *(p.y.size for p in parts)])
    source = ", ".join(log.source for log in logs if log.source) or "a log"
    seconds = sum(float(p.keep.sum()) * p.dt for p in parts)
    alpha = X[:, 0] * vehicle.number("steering_ratio")
    if seconds < LEAST_SECONDS or rms(alpha[offered]) < LEAST_SLIP:
        raise LogError(
            f"{source}: {seconds:.0f} s faster than {SLOW:g} m/s with a slip angle of {rms(alpha[offered]):.2g} rad (RMS)",
            f"at least {LEAST_SECONDS:g} s and {LEAST_SLIP:g} rad", "record a longer drive, with curves",
        )  # fmt: skip
    fit = regress(X, y, offered, pieces, trim=True)
    K, sd = float(fit.solution[0]), float(max(fit.sd[0], fit.sd_hac[0]))
    if K <= 0:
        raise LogError(
            f"{source}: K_aln = {K:.3g} N m/rad: {by} pushes the wheel away from where the car goes",
            "a torque that turns it back, positive to the left as the angle is",
            "give torque or angle a sign of -1 in the names file",
        )  # fmt: skip
    if not sd <= SURE * K:
        raise LogError(
            f"{source}: K_aln = {K:.3g} N m/rad with a standard error of {sd:.2g}", f"at most {SURE:.0%}",
            "record a longer drive with more curves, or check that torque and motion are on one clock",
        )  # fmt: skip
    used = fit.used
    left = y - X @ fit.solution
    held = _halves(X, y, used)
    half = fit.interval_factor * sd
    total = float(np.var(y[used]))
    return StiffnessFit(
        K, sd, K - half, K + half, float(fit.solution[1]), rms(left[used]), 1 - rms(left[used]) ** 2 / total,
        rms(held[used]), 1 - rms(held[used]) ** 2 / total, slip_from, by, seconds,
        tuple(_findings(X, y, left, used, fit.trimmed, held, alpha)), alpha[used],
        (y - X[:, 1:] @ fit.solution[1:])[used], source,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Rows:
    """A drive as the regression takes it."""

    X: Array
    y: Array
    keep: Flags
    dt: float
    slip_from: str
    by: str


def _rows(log: Log, vehicle: Vehicle) -> _Rows:
    """Regressors alpha / g_s, 1 (and rate, presliding for a sensor), and the torque they explain."""
    name = log.source or "this log"
    by = ALIGNMENT if ALIGNMENT in log else SENSOR
    lacking = [n for n in (ANGLE, SPEED) if n not in log] + ([] if by in log else [f"{ALIGNMENT} or {SENSOR}"])
    if lacking:
        raise MissingSignal(
            f"{name} lacks {', '.join(lacking)}", "angle, speed, and a torque that the tyres' can be told from",
            "map them in a names file; `codriver info LOG` lists the channels",
        )  # fmt: skip
    own = all(n in log for n in MOTION)
    wanted = ["steering_ratio", "front_axle_distance"]
    wanted += (
        [] if own else ["mass", "yaw_inertia", "wheelbase", "front_cornering_stiffness", "rear_cornering_stiffness"]
    )
    if missing := [p for p in wanted if p not in vehicle]:
        raise VehicleError(
            f"vehicle '{vehicle.name}' lacks {', '.join(missing)}",
            "the steering and the front axle, and a whole single track where the log has no sideslip_angle and yaw_rate",
            "add them to the vehicle file",
        )
    signals = [ANGLE, SPEED, by, *(MOTION if own else ())]
    dt = 1.0 / suggest_rate(log, [ANGLE, by])
    start = max(float(log[n].time[0]) for n in signals)
    grid = log.sample(signals, dt, start=start, stop=max(min(float(log[n].time[-1]) for n in signals), start))
    there = np.all([grid.held[n] & np.isfinite(grid.values[n]) for n in signals], axis=0)
    angle, speed, torque = (np.where(there, grid.values[n], 0.0) for n in (ANGLE, SPEED, by))
    ratio, front = vehicle.number("steering_ratio"), vehicle.number("front_axle_distance")
    driven = np.maximum(speed, SLOWEST)
    if own:
        beta, r = (np.where(there, grid.values[n], 0.0) for n in MOTION)
    else:
        beta, r = _single_track(SingleTrack.from_vehicle(vehicle), angle / ratio, driven, dt)
    alpha = angle / ratio - beta - front * r / driven
    columns = [alpha / ratio, np.ones(alpha.size)]
    if by == SENSOR:
        columns += [np.gradient(angle, dt), _presliding(angle)]
    y = torque if by == SENSOR else -torque
    slip_from = "log" if own else "single track"
    return _Rows(np.column_stack(columns), y, there & (speed > SLOW), dt, slip_from, by)


def _single_track(track: SingleTrack, steer: Array, speed: Array, dt: float) -> tuple[Array, Array]:
    """Sideslip and yaw rate of the single track along a drive."""
    beta, r = np.zeros(steer.size), np.zeros(steer.size)
    state = 0.0, 0.0
    for k, (delta, v) in enumerate(zip(steer.tolist(), speed.tolist(), strict=True)):
        state = track.advance(*state, delta, v, dt)
        beta[k], r[k] = state
    return beta, r


def _presliding(angle: Array) -> Array:
    """Friction's state along the drive, from -1 to 1."""
    z, path = 0.0, np.empty(angle.size)
    for k, moved in enumerate((np.diff(angle, prepend=angle[:1]) / WIDTH).tolist()):
        z = (z + moved) / (1.0 + abs(moved))
        path[k] = z
    return path


def _halves(X: Array, y: Array, used: Flags) -> Array:
    """Residuals of each half by the fit of the other."""
    middle = int(np.flatnonzero(used)[used.sum() // 2])
    first = used & (np.arange(y.size) < middle)
    left = np.zeros(y.size)
    for mine, other in ((first, used & ~first), (used & ~first, first)):
        left[mine] = y[mine] - X[mine] @ solve(X[other], y[other])
    return left


def _findings(X: Array, y: Array, left: Array, used: Flags, trimmed: float, held: Array, alpha: Array) -> list[Finding]:
    """Whether the line bends, and how the halves do."""
    said = []
    cubic = solve(np.column_stack([X[used], alpha[used] ** 3]), y[used])
    most = float(np.quantile(np.abs(alpha[used]), 0.99))
    line = float(X[used][:, 0] @ alpha[used] / (alpha[used] @ alpha[used])) * float(cubic[0])  # N m/rad
    bend = -float(cubic[-1]) * most**2 / max(abs(line), 1e-300)
    if abs(bend) > BEND:
        how = "falls short of" if bend > 0 else "exceeds"
        said.append(Finding(
            "warn", f"the torque {how} a line by {abs(bend):.0%} at a slip angle of {most:.2g} rad: a tyre's trail shrinks with "
            "slip; K_aln is that of this drive's slip angles",
        ))  # fmt: skip
    if trimmed > 0.02:
        said.append(Finding("warn", f"{trimmed:.1%} of the ticks fit no line and are left out: a slide, off the road?"))
    off, own = rms(held[used]), rms(left[used])
    if off > 1.5 * own:
        said.append(
            Finding("warn", f"the halves do not agree: {off:.2g} N m off by the other's fit, {own:.2g} by their own")
        )
    if not said:
        said.append(Finding("ok", f"a line explains the torque to {off:.2g} N m on the half that it was not fitted to"))
    return said
