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
variances that go with it (`motorcycle_gains`, with its certificate). A missing row is left out without its gain being put right.

What leans by much is not linear, tyres are wide, and a gyroscope's bias b is no noise: none of this is in P. So the roll's standard
deviation is told as sqrt(P_phi + (share phi)^2 + (v b / g)^2 + (b T)^2), see `LinearNoise`. `speed_in_range` is 0 outside the
speeds designed for; `valid` is 1 where it is 1, and all rows have come for `SETTLE` seconds, with gaps of `STALE` at most.

Damon, Ichalal, Arioui 2018, eq. (12), (21)-(23); Kalman 1960, doi:10.1115/1.3662552.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from codriver.errors import UsageError
from codriver.kernel import Scalar, both, minimum, negate, select, sqrt
from codriver.models.lpv import LPV
from codriver.models.road_frame import GRAVITY, by_turn
from codriver.names import quantity
from codriver.observers.arrivals import all_came, arrivals_carry, note_arrivals
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import Matrix, predict_covariance, predict_mean, update_row
from codriver.observers.motorcycle_gains import (
    ROWS,
    SIZES,
    LinearNoise,
    MotorcycleGains,
    design_motorcycle_gains,
    filter_rows,
    node_shares,
)
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.sample_scatter import learn_scatter, scatter_carry
from codriver.observers.scaled_gain import check_tick
from codriver.observers.series import series, terms_needed
from codriver.signals.signal import Array

SPEED = "longitudinal_speed"
SENSED = ("steer_angle", "roll_rate", "yaw_rate")  # as the IMU has them
CLOSE, TERMS = 1e-4, 14
GAP, STALE, SETTLE = 1.0, 0.25, 2.0  # s
SCATTER, SCATTER_TIME = dict.fromkeys(SENSED[1:], 0.05), 2.0  # rad/s until learnt, s
HOLD = 2.0  # T, s: over which the roll rate's bias adds up
MOST = 1e5  # of any state, so that nonsense stays finite
# Standard deviations of the states at the start.
START = np.array([0.15, 0.05, 0.5, 0.3, 0.3, 0.5, 500.0, 500.0, 30.0])


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
        shares = node_shares(made.speeds, v)

        def at(column: Array) -> Scalar:
            return sum(share * float(value) for share, value in zip(shares, column, strict=True))

        e = [select(fresh[k], values[k] - predict_mean(x, [C[k]])[0], 0.0) for k in range(m)]
        x = [x[i] + sum(at(made.K[:, i, k]) * e[k] for k in range(m)) for i in range(n)]
        told = [(e[k], at(made.innovations[:, k])) for k in range(m)]
        return x, {}, [at(made.variances[:, i]) for i in range(n)], told

    return update


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
