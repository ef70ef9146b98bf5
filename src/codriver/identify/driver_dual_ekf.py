"""A driver's parameters tick by tick: a dual extended Kalman filter, one for his state and one for his parameters.

    x- = f(x, u, p),   P- = F P F' + Q,   e = T_dr - x-_T,   S = P-_TT + R              state: x = (lag, two of the delay, torque)
    D- = F D + df/dp,   h = row of the torque in D-                                     recurrent derivative dx/dp
    x = x- + K e,   D = (I - K C) D-,   p = p + Pp h' e / (h Pp h' + S)                 parameters: a slow random walk

u = (theta_near, theta_far, delta_s), p = logarithms of the parameters. f is the driver of `models.two_point` with the delay as a
Pade fraction of second order, lags exact for inputs held over a tick. Wan, Nelson, "Dual extended Kalman filter methods" (in
Haykin, ed., Kalman Filtering and Neural Networks, Wiley 2001, chapter 5). You, Lu, Tsiotras 2017, "Nonlinear driver parameter
estimation and driver steering behavior analysis for ADAS using field test data" (IEEE Transactions on Human-Machine Systems
47(5), 686-699) identify a two-point driver so; Okamoto, Tsiotras 2019 take it from there for their figure 15.

Their Remark 4, that a dual filter cannot identify where dh/dp is 0, holds where D- = df/dp only: with the recurrence a parameter
shows in the output as soon as its effect has gone through the state.

For comparison only: it depends on its tuning, its standard deviations hold what the tuning assumes, not what drives show, and a
driver who varies biases it as he does least squares. `driver_fit` is what to use.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from codriver.identify.driver_record import DriverRecord
from codriver.models.two_point import TwoPointDriver
from codriver.signals.signal import Array

# A CasADi SX or function; CasADi ships no types.
Value = Any
RATE = 50.0  # Hz
_STATES = 4


@dataclass(frozen=True)
class DualTuning:
    """Noises.

    Attributes:
        doubt: of a tick's torque against the model, N m. As small as the sensor's noise it makes the filters sure of wrong
            values before they have found right ones. On the circuit, started a fifth to a half off with a spread of 0.5, they end
            with an eighth of the delay and 1.7 times K_c with 2 N m and less, and near the truth with 4 and 8.
        torque: that the model's torque gathers, N m per sqrt(s).
        wander: of the parameters' logarithms, 1 per sqrt(s).
        spread: of the logarithms before the drive.
    """

    doubt: float = 4.0
    torque: float = 0.05
    wander: float = 1e-3
    spread: float = 0.3


@dataclass(frozen=True, eq=False)
class DualFit:
    """What the filters found.

    Attributes:
        names: of the parameters.
        time: s from the record's start, shape (n,).
        values, sd: of each parameter over time, SI, shape (n, p).
        covariance: of the logarithms at the end, shape (p, p).
        errors: e, N m, shape (n,).
    """

    names: tuple[str, ...]
    time: Array = field(repr=False)
    values: Array = field(repr=False)
    sd: Array = field(repr=False)
    covariance: Array = field(repr=False)
    errors: Array = field(repr=False)

    @property
    def tick(self) -> float:
        """s."""
        return float(self.time[1] - self.time[0])

    def last(self) -> dict[str, tuple[float, float]]:
        """Value and standard deviation at the end."""
        return {n: (float(v), float(s)) for n, v, s in zip(self.names, self.values[-1], self.sd[-1], strict=True)}


def dual_ekf(
    record: DriverRecord,
    known: TwoPointDriver,
    names: tuple[str, ...],
    tuning: DualTuning | None = None,
    *,
    recurrent: bool = True,
) -> DualFit:
    """Run both filters over a drive.

    Args:
        record: of the drive.
        known: where to start, and the parameters that are not sought.
        names: of the parameters sought.
        tuning: noises.
        recurrent: carry dx/dp on; otherwise it is df/dp, as in Remark 4.
    """
    import casadi as ca

    tuning = tuning or DualTuning()
    every = max(round(1 / (RATE * record.dt)), 1)
    dt = every * record.dt
    rows = slice(record.first, record.last, every)
    given = np.stack([record.near[rows], record.far[rows], record.angle[rows], record.torque[rows]])
    p, n = len(names), given.shape[1]
    step = _step(known, names, record.speed, dt, tuning, recurrent)
    logs = np.log([max(getattr(known, name), 1e-3) for name in names])
    x0 = np.array([given[0, 0], 0.0, 0.0, given[3, 0]])
    carry = [x0, 0.1 * np.eye(_STATES), logs, tuning.spread**2 * np.eye(p), np.zeros((_STATES, p))]
    start = np.concatenate([np.ravel(part, order="F") for part in carry])
    # mapaccum carries one vector; what is kept comes beside it.
    ran = step.mapaccum("run", n, 1, {"base": 16})(start, given)
    kept = np.array(ca.DM(ran[1])).T
    theta, variance, errors = kept[:, :p], kept[:, p : 2 * p], kept[:, -1]
    values, end = np.exp(theta), np.array(ca.DM(ran[0]))[:, -1]
    first = _STATES + _STATES**2 + p
    return DualFit(
        names, dt * np.arange(1, n + 1) + record.first * record.dt, values, values * np.sqrt(variance),
        end[first : first + p * p].reshape(p, p), errors,
    )  # fmt: skip


def _step(
    known: TwoPointDriver, names: tuple[str, ...], speed: float, dt: float, tuning: DualTuning, recurrent: bool
) -> Any:
    """(carry, what he saw and his torque) to (carry, parameters, their variances, e), as a CasADi function."""
    import casadi as ca

    p = len(names)
    x, theta, u = ca.SX.sym("x", _STATES), ca.SX.sym("theta", p), ca.SX.sym("u", 4)
    P, Pp, D = ca.SX.sym("P", _STATES, _STATES), ca.SX.sym("Pp", p, p), ca.SX.sym("D", _STATES, p)
    after = _advance(known, names, x, theta, u, speed, dt)
    F, through = ca.jacobian(after, x), ca.jacobian(after, theta)
    Q, Qp = ca.diag(ca.DM([0, 0, 0, tuning.torque**2 * dt])), tuning.wander**2 * dt * ca.DM.eye(p)
    P_, Pp_, D_ = F @ P @ F.T + Q, Pp + Qp, (F @ D if recurrent else 0) + through
    e, S = u[3] - after[3], P_[3, 3] + tuning.doubt**2
    K, h = P_[:, 3] / S, D_[3, :]
    Kp = Pp_ @ h.T / (h @ Pp_ @ h.T + S)
    theta_ = theta + Kp * e
    P_new, Pp_new = P_ - K @ P_[3, :], Pp_ - Kp @ h @ Pp_
    carry = [after + K * e, (P_new + P_new.T) / 2, theta_, (Pp_new + Pp_new.T) / 2, D_ - K @ h]
    before = ca.vertcat(*(ca.vec(part) for part in (x, P, theta, Pp, D)))
    new = ca.vertcat(*(ca.vec(part) for part in carry))
    return ca.Function("tick", [before, u], [new, ca.vertcat(theta_, ca.diag(carry[3]), e)])


def _advance(
    known: TwoPointDriver, names: tuple[str, ...], x: Value, theta: Value, u: Value, speed: float, dt: float
) -> Value:
    """f."""
    import casadi as ca

    q = {n: getattr(known, n) for n in vars(known)} | {n: ca.exp(theta[k]) for k, n in enumerate(names)}
    keep = ca.exp(-dt / q["lag"])
    slow = keep * x[0] + (1 - keep) * u[0]
    quick = q["lead"] / q["lag"]
    wanted = q["anticipation"] * u[1] + q["compensation"] / speed * (quick * u[0] + (1 - quick) * slow)
    # The delay's two states by the trapezoidal rule: (I - A dt / 2) d+ = (I + A dt / 2) d + B dt wanted.
    rate = 1 / q["delay"]
    A = ca.vertcat(ca.horzcat(0, 1), ca.horzcat(-12 * rate**2, -6 * rate))
    late = ca.solve(ca.SX.eye(2) - A * dt / 2, (ca.SX.eye(2) + A * dt / 2) @ x[1:3] + ca.vertcat(0, dt) * wanted)
    delayed = wanted - 12 * rate * late[1]
    hold = q["column_gain"] * speed + q["reflex"]
    relax = ca.exp(-dt / q["muscle"])
    torque = relax * x[3] + (1 - relax) * (hold * delayed - q["reflex"] * u[2])
    return ca.vertcat(slow, late, torque)
