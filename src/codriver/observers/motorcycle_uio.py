"""The motorcycle's unknown-input observer: a state that the rider's torque does not reach, and the torque from what is left.

    z' = N(v) z + L(v) y,   x^ = z - E y,        e' = N(v) e whatever the torque does, at any change of speed
    E = -D (C D)^+,   P = 1 + E C,   N = P A(v) - K(v) C,   L = K(v) (1 + C E) - P A(v) E
    tau^ = ((C D)^+ y - l) / T - g,   l' = ((C D)^+ y - l) / T,   g' = ((C D)^+ C A(v) x^ - g) / T

D is where the torque enters, and does not depend on the speed, nor do E and P. It exists where rank(C D) = rank(D) (the torque
shows in the first derivative of what is measured) and no zero of the torque to y lies in the right half plane, at each speed of a
grid: `uio_design` refuses else. K is the Kalman gain of (P A, C) at both ends of the range and straight between them; that N is
stable between is checked on the grid, at each speed kept. T is the time constant with which the torque is told.

Over a tick measurements run straight, and z moves by Taylor's series (`series`). E y hands the sensors' noise on as it is, and the
torque is a derivative of it: no bands, since no noise is assumed of the input. Measurements are inputs, in the road's frame, as in
`motorcycle_ts`.

Darouach, Zasadzinski, Xu 1994, doi:10.1109/9.280770; of motorcycles: Damon, Ichalal, Arioui, Mammar 2017 (ITSC), as the 2018 paper
cites such observers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, both, minimum, select
from codriver.models.lpv import LPV
from codriver.models.state_space import StateSpace, matrix_exponential
from codriver.names import quantity
from codriver.observers.observer import Certificate, Observer, Output, Scalars
from codriver.observers.series import series, terms_needed
from codriver.observers.uio_design import UIODesign, design_unknown_input_observer
from codriver.signals.signal import Array

TORQUE = "rider_torque"
GRID = 21
CLOSE, TERMS = 1e-5, 20
SETTLED = 100.0  # an error falls to this fraction before `valid`
MOST = 1e6  # of any state, so that nonsense stays finite
# What walks beside the torque, per sqrt(Hz), by state; sd of the measurements per sqrt(Hz): rad, rad/s, rad/s, rad/s, m/s^2.
WALKS = (0.02, 0.002, 0.1, 0.1, 0.1, 0.1, 300.0, 300.0)
SENSORS = {
    "steer_angle": 1e-4, "yaw_rate": 1e-3, "roll_rate": 1e-3, "steer_rate": 5e-3, "lateral_acceleration": 0.05,
}  # fmt: skip
SIZES = np.array([0.1, 0.01, 0.5, 0.2, 0.2, 0.2, 300.0, 300.0])


@dataclass(frozen=True, eq=False)
class MotorcycleUIO:
    """A design.

    Attributes:
        model: the motorcycle, 8 states, rider_torque its input.
        low, high: m/s.
        K: at low and at high, shape (8, p) each.
        E: shape (8, p).
        inverse: (C D)^+, shape (1, p).
        tau: T, s.
        certificate: of the grid.
    """

    model: LPV
    low: float
    high: float
    K: tuple[Array, Array]
    E: Array
    inverse: Array
    tau: float
    certificate: Certificate

    def affine(self) -> tuple[Array, Array, Array, Array]:
        """M_0, M_1 and L_0, L_1 of (z, l, g)' = (M_0 + v M_1) (z, l, g) + (L_0 + v L_1) y."""
        C, E, T = self.model.C, self.E, self.tau
        n, p = E.shape
        slope = (self.K[1] - self.K[0]) / (self.high - self.low)
        found = []
        for A, K in zip(
            (self.model.powers[0], self.model.powers[1]), (self.K[0] - self.low * slope, slope), strict=True
        ):
            PA = (np.eye(n) + E @ C) @ A
            told = self.inverse @ C @ A / T
            M, L = np.zeros((n + 2, n + 2)), np.zeros((n + 2, p))
            M[:n, :n], M[n + 1, :n] = PA - K @ C, told
            L[:n], L[n + 1] = K @ (np.eye(p) + C @ E) - PA @ E, -told @ E
            found.append((M, L))
        (M0, L0), (M1, L1) = found
        M0[n, n] = M0[n + 1, n + 1] = -1 / T
        L0[n] = self.inverse / T
        return M0, M1, L0, L1


def design_motorcycle_uio(model: LPV, low: float, high: float, dt: float = 0.01, tau: float = 0.05) -> MotorcycleUIO:
    """Design and certify.

    Args:
        model: `motorcycle_model(p)`, perhaps with fewer outputs.
        low, high: range of speed, m/s.
        dt: tick, s.
        tau: T, s.

    Raises:
        DesignError: there is none at some speed, or it is not stable between.
    """
    strange = [name for name in model.outputs if name not in SENSORS]
    if strange:
        raise DesignError(f"outputs {strange}", f"some of {', '.join(SENSORS)}", "leave them out")
    R = np.square([SENSORS[name] for name in model.outputs])
    Q = np.square(np.array(WALKS) / SIZES)
    speeds = np.linspace(low, high, GRID)
    made: list[UIODesign] = []
    for v in speeds:
        try:
            made.append(design_unknown_input_observer(_scaled(model, float(v)), (TORQUE,), Q, R, tau))
        except DesignError as error:
            raise DesignError(f"at {v:.4g} m/s: {error.found}", error.expected, error.do) from None
    K = (made[0].K * SIZES[:, None], made[-1].K * SIZES[:, None])
    C, D = model.C, model.B
    inverse = np.asarray(np.linalg.pinv(C @ D))
    design = MotorcycleUIO(model, low, high, K, -D @ inverse, inverse, tau, made[0].certificate)
    M0, M1, _, _ = design.affine()
    n = len(model.states)
    poles = [np.linalg.eigvals((M0 + v * M1)[:n, :n]).astype(complex) for v in speeds]
    sampled = [np.linalg.eigvals(matrix_exponential((M0 + v * M1)[:n, :n] * dt)).astype(complex) for v in speeds]
    every = np.concatenate(poles)
    if not every.real.max() < 0:
        raise DesignError(
            f"a pole at {every.real.max():+.3g} 1/s between {low:g} and {high:g} m/s", "a stable observer at every speed",
            "a narrower range of speed",
        )  # fmt: skip
    leak = float(np.abs((np.eye(n) + design.E @ C) @ D).max() / np.abs(D).max())
    claims = (
        f"rank(C D) = rank(D), eq. (51), and no zero in the right half plane at {GRID} speeds from {low:g} to {high:g} m/s",
        f"the error does not see the torque: (1 + E C) D = 0 to {leak:.1e}",
        f"at those speeds, each kept, the error decays with {-every.real.max():.3g} 1/s or quicker",
    )
    decay = float(-every.real.max())
    return MotorcycleUIO(
        model, low, high, K, design.E, inverse, tau, Certificate(True, claims, every, np.concatenate(sampled), decay)
    )


def motorcycle_uio(design: MotorcycleUIO, dt: float = 0.01) -> Observer:
    """The observer of a design.

    Args:
        design: by `design_motorcycle_uio`.
        dt: tick, s.

    Raises:
        DesignError: a tick too long for its poles.
    """
    model, E, inverse, T = design.model, design.E, design.inverse, design.tau
    n, p = E.shape
    M0, M1, L0, L1 = design.affine()
    W = np.array([*SIZES, 0.1, 10.0])
    scaled = [(M0 + v * M1) * W / W[:, None] for v in (design.low, design.high, 1.25 * design.high)]
    terms = terms_needed(scaled, dt, CLOSE, TERMS)
    low, high, speed = design.low, design.high, model.scheduling
    settle = float(np.log(SETTLED) / min(design.certificate.decay_rate, 1 / T))

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        import casadi as ca

        there: Scalar = ok[speed]
        for name in model.outputs:
            there = both(there, ok[name])
        v = select(ok[speed], rho[speed], carry["speed"])
        begun = carry["begun"]
        last = [carry[f"y_{k}"] for k in range(p)]
        now = [select(ok[c], u[c], last[k]) for k, c in enumerate(model.outputs)]
        first = [select(begun, a, b) for a, b in zip(last, now, strict=True)]
        whole = ca.SX(n + 2 + p, n + 2 + p)
        whole[: n + 2, : n + 2] = ca.SX(ca.DM(M0)) + v * ca.SX(ca.DM(M1))
        whole[: n + 2, n + 2 :] = ca.SX(ca.DM(L0)) + v * ca.SX(ca.DM(L1))
        x = ca.vertcat(*[carry[f"z_{i}"] for i in range(n + 2)])
        state = ca.vertcat(x, *first)
        slope = ca.vertcat(*[(b - a) * (1 / dt) for a, b in zip(first, now, strict=True)])
        rate = whole[: n + 2, :] @ state
        moved = x + series(whole, ca.vertcat(rate, slope), dt, terms)[: n + 2]
        # It starts from rest, the low-pass where its input is.
        y_now = ca.vertcat(*now)
        told = ca.SX(ca.DM(inverse)) @ y_now
        z = []
        for i in range(n + 2):
            value = select(begun, moved[i], select(there, told, 0.0) if i == n else 0.0)
            z.append(select(value > MOST, MOST, select(value < -MOST, -MOST, value)))
        estimate = ca.vertcat(*z[:n]) - ca.SX(ca.DM(E)) @ y_now
        torque = (told - z[n]) * (1 / T) - z[n + 1]
        inside = both(ok[speed], both(v >= low, v <= high))
        started = select(begun, 1.0, there)
        since = select(both(both(there, inside), begun), minimum(carry["since"] + dt, 2 * settle), 0.0)
        new = {
            **{f"z_{i}": value for i, value in enumerate(z)}, **{f"y_{k}": value for k, value in enumerate(now)},
            "speed": v, "begun": started, "since": since,
        }  # fmt: skip
        found = {name: select(started, estimate[i], 0.0) for i, name in enumerate(model.states)}
        flags = {"certified": inside, "measured": there, "valid": both(inside, since > settle)}
        return new, {**found, TORQUE: select(started, torque, 0.0), **flags}

    begin = dict.fromkeys(
        [*(f"z_{i}" for i in range(n + 2)), *(f"y_{k}" for k in range(p)), "speed", "begun", "since"], 0.0
    )
    outputs = (
        *(Output(o, quantity(o).unit, "estimate", quantity(o).meaning) for o in (*model.states, TORQUE)),
        Output("certified", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("measured", "1", "flag", "1 where all measurements are there"),
        Output("valid", "1", "flag", "1 where certified, measured, and settled"),
    )
    gains = {"E": E, "K_1": design.K[0], "K_2": design.K[1]}
    return Observer(
        "motorcycle-uio", dt, model.outputs, (), begin, outputs, step, scheduling=(speed,), gains=gains,
        settings={"low": low, "high": high, "tau": T, "terms": terms, "settling": settle}, certificate=design.certificate,
    )  # fmt: skip


def _scaled(model: LPV, v: float) -> StateSpace:
    """The plant at a speed with states in units in which they compare."""
    plant = model.at(v)
    return StateSpace(
        plant.A * SIZES / SIZES[:, None], plant.B / SIZES[:, None], plant.C * SIZES, plant.D, plant.states, plant.inputs,
        plant.outputs,
    )  # fmt: skip
