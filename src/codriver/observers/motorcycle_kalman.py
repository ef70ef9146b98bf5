"""The motorcycle's Kalman filter on the linear parameter-varying model, in its Kalman and its constant-gain form.

    x' = A(v) x + w,   x = (phi, delta, v_y, W, phi', delta', Y_f, Y_r, tau),        A(v) = A_0 + v A_1        (12), (23)
    predict   x- = F(v) x,   P- = F P F' + Q dt,      F(v) = 1 + A dt + A^2 dt^2/2 + ...
    update    row by row, where it is fresh:          delta,   p = phi',   W = r / cos phi,   0 = (Y_f + Y_r) / M - v W

The same model and sensors as `motorcycle_ts`. Its steer rate the filter has from the encoder. W is made of the gyroscope's r and
the speed as in a balanced turn (`models.road_frame`). That the turn is balanced, a = v W, is the last row: it errs by what that
leaves out, and not by the gyroscope's noise, which would stand in two rows if v times the measured W were taken.

**Kalman form**: the covariance is carried, so that missing rows and several rates are exact; what the rates' samples scatter by is
learnt (`learn_scatter`) and comes on top of the noise told.
**Constant form** (small, for export): the stationary gain K(v), solved at `NODES` speeds and straight between them, and the
variances that go with it. A missing row is left out without its gain being put right. The certificate says that all poles of
F(v) (1 - K(v) C(v)) lie inside the unit circle at `GRID` speeds, each kept; a fast change of speed is not covered.

What leans by much is not linear, tyres are wide, and a gyroscope's bias b is no noise: none of this is in P. So the roll's standard
deviation is told as sqrt(P_phi + (share phi)^2 + (v b / g)^2 + (b T)^2), see `LinearNoise`. `speed_in_range` is 0 outside the
speeds designed for; `valid` is 1 where it is 1, and all rows have come for `SETTLE` seconds, with gaps of `STALE` at most.

Damon, Ichalal, Arioui 2018, eq. (12), (21)-(23); Kalman 1960, doi:10.1115/1.3662552.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from codriver.errors import DesignError, UsageError
from codriver.kernel import Scalar, both, minimum, negate, select, sqrt
from codriver.models.lpv import LPV
from codriver.models.road_frame import GRAVITY, by_turn
from codriver.models.state_space import matrix_exponential
from codriver.names import quantity
from codriver.observers.arrivals import all_came, arrivals_carry, note_arrivals
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import Matrix, predict_covariance, predict_mean, update_row
from codriver.observers.observer import Certificate, Observer, Output, Scalars
from codriver.observers.riccati import stationary_predicted, tick_map
from codriver.observers.sample_scatter import learn_scatter, scatter_carry
from codriver.observers.scaled_gain import check_tick
from codriver.observers.series import series, terms_needed
from codriver.signals.signal import Array

DEGREE = np.pi / 180
SPEED = "longitudinal_speed"
SENSED = ("steer_angle", "roll_rate", "yaw_rate")  # as the IMU has them
ROWS = {"steer_angle": "rad", "roll_rate": "rad/s", "yaw_rate": "rad/s", "balance": "m/s^2"}  # of the model
NODES, GRID = 9, 41
CLOSE, TERMS = 1e-4, 14
GAP, STALE, SETTLE = 1.0, 0.25, 2.0  # s
SCATTER, SCATTER_TIME = dict.fromkeys(SENSED[1:], 0.05), 2.0  # rad/s until learnt, s
HOLD = 2.0  # T, s: over which the roll rate's bias adds up
MOST = 1e5  # of any state, so that nonsense stays finite
# Sizes of the states, in which matrices compare; standard deviations at the start.
SIZES = np.array([0.1, 0.01, 0.5, 0.2, 0.2, 0.2, 300.0, 300.0, 10.0])
START = np.array([0.15, 0.05, 0.5, 0.3, 0.3, 0.5, 500.0, 500.0, 30.0])


@dataclass(frozen=True)
class LinearNoise:
    """What the linear model and its sensors leave out.

    Attributes:
        lateral, yaw, roll, steer: white noise of the accelerations, m/s^2, rad/s^2 per sqrt(Hz).
        tyre: of the tyre forces' rates, N/s per sqrt(Hz).
        torque: of the rider's torque's rate, N m/s per sqrt(Hz).
        encoder, gyro, turn, balance: sd of a sample of the rows: rad, rad/s, rad/s, m/s^2.
        sample: sd of a gyroscope's sample where it is not learnt, rad/s.
        share: systematic error of the roll in parts of it.
        bias: of the gyroscope, rad/s, which nothing here finds.
        rate: at which samples err independently, Hz; the sd of a row at another tick is that times sqrt(1 / (rate dt)).
    """

    lateral: float = 0.15
    yaw: float = 0.15
    roll: float = 0.15
    steer: float = 1.0
    tyre: float = 800.0
    torque: float = 60.0
    encoder: float = 0.001
    gyro: float = 0.005
    turn: float = 0.01
    balance: float = 0.3
    sample: float = 0.015
    share: float = 0.06
    bias: float = 0.006
    rate: float = 100.0

    def process(self) -> Array:
        """Intensities of the states, shape (9,)."""
        return np.square([0, 0, self.lateral, self.yaw, self.roll, self.steer, self.tyre, self.tyre, self.torque])

    def rows(self, dt: float, scatter: Sequence[Scalar] | None = None) -> list[Scalar]:
        """Variances of a tick's rows.

        Args:
            dt: tick, s.
            scatter: variances learnt of the samples of roll rate and yaw rate; None for `sample`.
        """
        share = 1 / (self.rate * dt)
        more = (self.sample**2 * share,) * 2 if scatter is None else scatter
        own = [value**2 * share for value in (self.encoder, self.gyro, self.turn, self.balance)]
        return [own[0], own[1] + more[0], own[2] + more[1], own[3]]


@dataclass(frozen=True, eq=False)
class MotorcycleGains:
    """The stationary gains over the speed.

    Attributes:
        speeds: nodes, m/s, shape (m,).
        K: gains, shape (m, 9, 4).
        variances: of the states after the update, shape (m, 9).
        innovations: variances of the rows, shape (m, 4).
        certificate: poles at `GRID` speeds.
    """

    speeds: Array
    K: Array
    variances: Array
    innovations: Array
    certificate: Certificate

    def at(self, v: float) -> Array:
        """K(v), shape (9, 4); v clipped to the nodes."""
        return np.tensordot(_shares(self.speeds, float(np.clip(v, self.speeds[0], self.speeds[-1]))), self.K, 1)


def filter_rows(model: LPV) -> tuple[Array, Array]:
    """C_0 and C_1 of C(v) = C_0 + v C_1, shape (4, 9) each.

    Args:
        model: `motorcycle_model(p).with_walking_inputs()`.
    """
    C0, C1 = np.zeros((4, 9)), np.zeros((4, 9))
    for k, row in enumerate((*list(ROWS)[:3], "lateral_acceleration")):
        C0[k] = model.C[model.outputs.index(row)]
    C1[3, model.states.index("yaw_rate")] = -1
    return C0, C1


def design_motorcycle_gains(
    model: LPV, dt: float, low: float, high: float, noise: LinearNoise | None = None
) -> MotorcycleGains:
    """The stationary gains, certified.

    Args:
        model: `motorcycle_model(p).with_walking_inputs()`.
        dt: tick, s.
        low, high: range of speed, m/s.
        noise: of model and sensors.

    Raises:
        DesignError: there is no stationary covariance, or a pole between the nodes is not inside the unit circle.
    """
    noise = noise or LinearNoise()
    Q, R = np.diag(noise.process() * dt), np.array(noise.rows(dt))
    C0, C1 = filter_rows(model)
    speeds = np.linspace(low, high, NODES)
    gains, variances, innovations = [], [], []
    W = SIZES
    for v in speeds:
        # In units in which the states compare.
        F, c = matrix_exponential(model.A(v) * W / W[:, None] * dt), (C0 + v * C1) * W
        P = stationary_predicted([tick_map(F, Q / W / W[:, None], c, R)])
        S = c @ P @ c.T + np.diag(R)
        K = np.linalg.solve(S, c @ P).T
        gains.append(K * W[:, None])
        variances.append(np.diag(P - K @ c @ P) * W**2)
        innovations.append(np.diag(S))
    made = MotorcycleGains(speeds, np.array(gains), np.array(variances), np.array(innovations), _NONE)
    poles = []
    for v in np.linspace(low, high, GRID):
        closed = matrix_exponential(model.A(v) * dt) @ (np.eye(9) - made.at(v) @ (C0 + v * C1))
        poles.append(np.linalg.eigvals(closed).astype(complex))
    every = np.concatenate(poles)
    worst = float(np.abs(every).max())
    if not worst < 1:
        raise DesignError(
            f"the gains between {NODES} speeds from {low:g} to {high:g} m/s leave a pole of {worst:.4g}", "poles inside 1",
            "a narrower range of speed",
        )  # fmt: skip
    slowest = -np.log(worst) / dt
    claims = (
        f"at {GRID} speeds from {low:g} to {high:g} m/s, each kept, all poles of F (1 - K C) lie within {worst:.5g}",
        f"errors decay with {slowest:.3g} 1/s or quicker there",
    )
    certificate = Certificate(True, claims, np.log(every) / dt, every, float(slowest))
    return MotorcycleGains(made.speeds, made.K, made.variances, made.innovations, certificate)


_NONE = Certificate(False, (), np.empty(0, complex), np.empty(0, complex), 0.0)


def motorcycle_kalman(
    model: LPV, dt: float = 0.01, *, low: float = 5.0, high: float = 45.0, noise: LinearNoise | None = None,
    form: Literal["kalman", "constant"] = "kalman",
) -> Observer:  # fmt: skip
    """The filter.

    Args:
        model: `motorcycle_model(p).with_walking_inputs()`.
        dt: tick, s.
        low, high: range of speed, m/s.
        noise: of model and sensors.
        form: see the module's docstring.

    Raises:
        DesignError: no stationary gains, or a tick too long for the tyres.
        UsageError: no such form, or a tick that cannot be.
    """
    check_tick(dt)
    if form not in ("kalman", "constant"):
        raise UsageError(f"form '{form}'", "kalman or constant", "choose one")
    noise = noise or LinearNoise()
    C0, C1 = filter_rows(model)
    made = design_motorcycle_gains(model, dt, low, high, noise)
    scaled = {k: A * SIZES / SIZES[:, None] for k, A in model.powers.items()}
    terms = terms_needed([scaled[0] + v * scaled[1] for v in (low, 1.25 * high)], dt, CLOSE, TERMS)
    update = _covariance_update(dt, noise) if form == "kalman" else _table_update(made)
    n = len(model.states)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        import casadi as ca

        v = select(ok[SPEED], rho[SPEED], carry["speed"])
        came = note_arrivals(carry, SENSED, y, ok, dt)
        there = both(ok[SPEED], all_came(came, SENSED, STALE))
        begun, active = carry["begun"], select(carry["begun"], 1.0, there)
        road = by_turn(v, came["latest_yaw_rate"])
        values = [*(came[f"latest_{name}"] for name in SENSED[:2]), road.yaw_rate, 0.0]
        turning = both(ok["yaw_rate"], ok[SPEED])
        # The sample that it starts from is not taken twice.
        fresh = [both(begun, flag) for flag in (ok["steer_angle"], ok["roll_rate"], turning, turning)]
        C = [
            [float(a) + float(b) * v if b else float(a) for a, b in zip(*pair, strict=True)]
            for pair in zip(C0, C1, strict=True)
        ]

        A = ca.SX(ca.DM(model.powers[0])) + v * ca.SX(ca.DM(model.powers[1]))
        F = ca.SX.eye(n) + series(A, A, dt, terms)
        now = [carry[f"x_{i}"] for i in range(n)]
        # A balanced turn to start from.
        lean = -road.lateral_acceleration * (1 / GRAVITY)
        start = {0: lean, 1: values[0], 3: values[2], 4: values[1]}
        moved = predict_mean(now, [[F[i, j] for j in range(n)] for i in range(n)])
        x = [select(begun, moved[i], start.get(i, 0.0)) for i in range(n)]
        held = select(v < low, low, select(v > high, high, v))
        learnt = learn_scatter(carry, SENSED[1:], y, ok, SCATTER_TIME, dt) if form == "kalman" else {}
        found, memory, variances, told = update({**carry, **learnt}, F, x, C, values, fresh, held)
        found = [select(active, select(a > MOST, MOST, select(a < -MOST, -MOST, a)), 0.0) for a in found]
        keep = both(active, both(carry["blind"] < GAP, all_came(came, SENSED, GAP)))
        blind = select(ok[SPEED], 0.0, minimum(carry["blind"] + dt, 2 * GAP))
        since = select(both(keep, there), minimum(carry["since"] + dt, 2 * SETTLE), 0.0)
        inside = both(ok[SPEED], both(v >= low, v <= high))
        states = {f"x_{i}": a for i, a in enumerate(found)}
        new = {**states, **memory, **learnt, **came, "speed": v, "begun": keep, "blind": blind, "since": since}
        told_roll, unseen = noise.share * found[0], (noise.bias / GRAVITY) * v
        variances[0] = variances[0] + told_roll * told_roll + unseen * unseen + (noise.bias * HOLD) ** 2
        out: Scalars = {}
        for i, name in enumerate(model.states):
            out |= {_public(name): found[i], f"{_public(name)}_sd": sqrt(select(variances[i] > 0, variances[i], 0.0))}
        for row, (e, s) in zip(ROWS, told, strict=True):
            out |= {f"{row}_innovation": e, f"{row}_innovation_sd": sqrt(select(s > 0, s, 0.0))}
        flags = {"speed_in_range": inside, "lean_in_range": negate(road.outside), "valid": both(inside, since > SETTLE)}
        return {key: new[key] for key in begin}, out | flags

    own = {**carried(n), **scatter_carry(SCATTER)} if form == "kalman" else {f"x_{i}": 0.0 for i in range(n)}
    begin = {**own, **arrivals_carry(SENSED), "speed": low, "begun": 0.0, "blind": 0.0, "since": 0.0}
    return Observer(
        "motorcycle-kalman", dt, (), SENSED, begin, _outputs(model, low, high), step, scheduling=(SPEED,),
        settings={"low": low, "high": high, "form": form, "terms": terms},
        gains={f"K_{k}": K for k, K in enumerate(made.K)}, certificate=made.certificate,
    )  # fmt: skip


# Of carry, F, predicted state, C, values, which are fresh, held speed: state, own carry, variances, innovations and theirs.
Found = tuple[list[Scalar], Scalars, list[Scalar], list[tuple[Scalar, Scalar]]]
Update = Callable[[Scalars, Scalar, list[Scalar], Matrix, list[Scalar], list[Scalar], Scalar], Found]


def _covariance_update(dt: float, noise: LinearNoise) -> Update:
    """Kalman form."""
    Q, n = np.diag(noise.process() * dt).tolist(), len(SIZES)

    def update(
        carry: Scalars, F: Scalar, x: list[Scalar], C: Matrix, values: list[Scalar], fresh: list[Scalar], v: Scalar
    ) -> Found:
        P = predict_covariance(unpack(carry, n).P, [[F[i, j] for j in range(n)] for i in range(n)], Q)
        P = [[select(carry["begun"], P[i][j], START[i] ** 2 if i == j else 0.0) for j in range(n)] for i in range(n)]
        told, R = [], noise.rows(dt, [carry[f"scatter_{row}"] for row in SENSED[1:]])
        for k, row in enumerate(C):
            e = select(fresh[k], values[k] - predict_mean(x, [row])[0], 0.0)
            x, P, s = update_row(x, P, row, e, R[k], fresh[k])
            told.append((e, s))
        memory = {key: value for key, value in pack(Moments(x, P)).items() if key.startswith("P_")}
        return x, memory, [P[i][i] for i in range(n)], told

    return update


def _table_update(made: MotorcycleGains) -> Update:
    """Constant form."""
    n, m = made.K.shape[1:]

    def update(
        carry: Scalars, F: Scalar, x: list[Scalar], C: Matrix, values: list[Scalar], fresh: list[Scalar], v: Scalar
    ) -> Found:
        shares = _hats(made.speeds, v)

        def at(column: Array) -> Scalar:
            return sum(share * float(value) for share, value in zip(shares, column, strict=True))

        e = [select(fresh[k], values[k] - predict_mean(x, [C[k]])[0], 0.0) for k in range(m)]
        x = [x[i] + sum(at(made.K[:, i, k]) * e[k] for k in range(m)) for i in range(n)]
        told = [(e[k], at(made.innovations[:, k])) for k in range(m)]
        return x, {}, [at(made.variances[:, i]) for i in range(n)], told

    return update


def _hats(nodes: Array, v: Scalar) -> list[Scalar]:
    """Weights of the nodes for a value straight between them; exact sums to 1."""
    gap = float(nodes[1] - nodes[0])
    place = (v - float(nodes[0])) * (1 / gap)
    shares = []
    for k in range(len(nodes)):
        off = place - float(k)
        size = select(off < 0, -off, off)
        shares.append(select(size < 1, 1 - size, 0.0))
    return shares


def _shares(nodes: Array, v: float) -> Array:
    """The same in numbers."""
    return np.array([float(share) for share in _hats(nodes, v)])


def _public(name: str) -> str:
    """The model's yaw rate is about the road's normal."""
    return "heading_rate" if name == "yaw_rate" else name


def _outputs(model: LPV, low: float, high: float) -> tuple[Output, ...]:
    """All outputs."""
    outputs = []
    for name in map(_public, model.states):
        unit = quantity(name).unit
        outputs += [
            Output(name, unit, "estimate", quantity(name).meaning),
            Output(f"{name}_sd", unit, "sd", f"standard deviation of {name}"),
        ]
    for row, unit in ROWS.items():
        name = f"{row}_innovation"
        told = "tyre forces of a balanced turn less those predicted" if row == "balance" else f"{row} less predicted"
        outputs += [
            Output(name, unit, "innovation", f"{told}, along the road; 0 where none arrived"),
            Output(f"{name}_sd", unit, "innovation_sd", f"standard deviation of {name}"),
        ]
    return (
        *outputs,
        Output("speed_in_range", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("lean_in_range", "1", "flag", "1 where v r / g is below the sine of the greatest lean"),
        Output("valid", "1", "flag", "1 where the speed is in range and all rows have come for a while"),
    )
