"""The motorcycle's large-angle extended Kalman filter on the raw signals of an IMU, a steering encoder and a speed.

    x = (phi, delta, v_y, W, phi', delta', Y_f, Y_r, tau, M_phi, theta', b_p, b_q, b_r, b_y, b_z)

The first eight move as `models.motorcycle_lean` says, at any lean; the rider's torque tau walks. M_phi, N m, is a moment about the
road that nothing else explains: a leaning rider, a side wind, feet on the ground. theta' is a pitch rate that comes and goes within
`PITCH_TIME`. The biases of gyroscope and accelerometer walk slowly. In body axes (ISO 8855) the IMU at (X, n, Z) shows

    p = phi' + b_p,   q = theta' + W sin phi + b_q,   r = W cos phi + b_r
    f_y = a_y cos phi + (a_z + g) sin phi + b_y,      f_z = -a_y sin phi + (a_z + g) cos phi + b_z
    a_y = v_y' + v W + X W' - Z (phi'' cos phi - phi'^2 sin phi) - n (phi'' sin phi + phi'^2 cos phi) + W^2 (Z sin phi - n cos phi)
    a_z = (rho - Z)(phi'' sin phi + phi'^2 cos phi) + n (phi'' cos phi - phi'^2 sin phi)

with v_y', W', phi'' from the model, so that what the tyres do is told by the accelerometer. No acceleration is squared away, no turn
is taken as balanced, no pitch rate as zero.

**Tick.** x+ = x + (dt + A dt^2/2 + ...) f(x), F = 1 + A dt + A^2 dt^2/2 + ... with A at the last estimate, as many terms as the tick
needs up to the greatest speed (`_terms`). Rows one at a time, where fresh. v and v' come from the speed by a tracker of `TRACKING` rad/s.

**Start** at the first tick that has everything, at sin phi = (f_y - v r) / g: exact in a steady turn at any lean, and at rest. A gap of
`GAP` s, or a roll beyond `STEEPEST`, starts it anew.

**Noise.** What a row's samples scatter by is learnt from their second differences, which a motorcycle leaves alone and noise does not:
var = mean (y_k - 2 y_(k-1) + y_(k-2))^2 / 6, beside a floor for what the model leaves out. The model's own noise is `EkfNoise`.

**Slow.** Below `SLOW` m/s M_phi may be anything, since feet may be on the ground: roll is then gyroscope's and gravity's; `slow` is 1.
`speed_in_range` is 0 outside the speeds given, `valid` is 1 where speed is in range and not slow, signals come, and the roll's
standard deviation is below `SURE`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, both, minimum, negate, select, sqrt
from codriver.models.motorcycle_lean import LEAN_STATES, LeanParameters, lean_functions
from codriver.names import quantity
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import Matrix, update_row
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import check_tick
from codriver.signals.signal import Array

DEGREE = np.pi / 180
SPEED = "longitudinal_speed"
ROWS = ("roll_rate", "pitch_rate", "yaw_rate", "lateral_acceleration", "vertical_acceleration", "steer_angle")
NEEDED = ("roll_rate", "yaw_rate", "lateral_acceleration", "steer_angle", SPEED)
EXTRA = ("pitch_rate_beside_turning", "roll_rate_bias", "pitch_rate_bias", "yaw_rate_bias", "lateral_acceleration_bias",
         "vertical_acceleration_bias")  # fmt: skip
STATES = (*LEAN_STATES, *EXTRA)
N, MOVING, LEAN = len(STATES), 8, len(LEAN_STATES)
PITCH_TIME, MOMENT_TIME = 0.2, 2.0  # s
TRACKING = 4.0  # rad/s
GAP = 1.0  # s
SLOW = (2.0, 4.0)  # m/s: all of it below the first, none above the second
STEEPEST, SURE = 1.35, 3 * DEGREE
SCATTER_TIME = 2.0  # s
TERMS, CLOSE = 12, 1e-3
# What states cannot exceed, so that nonsense stays finite.
BOUNDS = (STEEPEST + 0.1, 1.0, 20.0, 6.0, 10.0, 30.0, 2e4, 2e4, 1e3, 5e3, 3.0, 1.0, 1.0, 1.0, 5.0, 5.0)
# Standard deviations at the start: roll rad, steer, v_y, rates, forces, torque, moment; pitch rate, biases.
START = (0.15, 0.05, 0.5, 0.2, 0.3, 0.5, 300.0, 300.0, 30.0, 50.0, 0.05, 0.02, 0.02, 0.02, 0.3, 0.3)


@dataclass(frozen=True)
class EkfNoise:
    """What the model leaves out, as white noise.

    Attributes:
        lateral, yaw, roll, steer: of the accelerations, m/s^2, rad/s^2 per sqrt(Hz).
        front, rear: of the tyre forces' rates, N/s per sqrt(Hz).
        torque: of the rider's torque's rate, N m/s per sqrt(Hz).
        moment: sd of M_phi, N m; `feet` of it when slow.
        feet: N m.
        pitch: sd of theta', rad/s.
        gyro_walk, accelerometer_walk: of the biases, rad/s and m/s^2 per sqrt(s).
        gyro, lateral_force, vertical_force, encoder: floors of the rows' sd, rad/s, m/s^2, rad.
    """

    lateral: float = 0.05
    yaw: float = 0.05
    roll: float = 0.05
    steer: float = 1.0
    front: float = 400.0
    rear: float = 400.0
    torque: float = 60.0
    moment: float = 10.0
    feet: float = 600.0
    pitch: float = 0.03
    gyro_walk: float = 1e-4
    accelerometer_walk: float = 1e-3
    gyro: float = 0.005
    lateral_force: float = 0.1
    vertical_force: float = 0.4
    encoder: float = 0.0005


def motorcycle_ekf(
    p: LeanParameters, dt: float = 0.01, *, low: float = 5.0, high: float = 45.0, noise: EkfNoise | None = None
) -> Observer:
    """The filter.

    Args:
        p: the machine.
        dt: tick, s.
        low, high: speeds between which it is claimed to hold, m/s.
        noise: of the model.

    Raises:
        DesignError: a tick too long for the tyres at the greatest speed.
        UsageError: a tick that cannot be.
    """
    check_tick(dt)
    noise = noise or EkfNoise()
    rates, linear = lean_functions(p)
    terms = _terms(linear, dt, high)
    Q = _process(noise, dt)
    floors = [noise.gyro] * 3 + [noise.lateral_force, noise.vertical_force, noise.encoder]
    fade = float(np.exp(-TRACKING * dt))
    forget = min(1.0, dt / SCATTER_TIME)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        begun = carry["begun"] > 0.5
        there: Scalar = 1.0
        for name in NEEDED:
            there = both(there, ok[name])
        track = _track(carry, y[SPEED], ok[SPEED], fade, dt)
        v = track["speed"]
        slowness = select(v < SLOW[0], 1.0, select(v > SLOW[1], 0.0, (SLOW[1] - v) * (1.0 / (SLOW[1] - SLOW[0]))))
        scatter = _scatter(carry, y, ok, forget)

        now = unpack(carry, N)
        f, A = _pieces(linear, now.x, v, track["speed_rate"])
        F = _transition(A, dt, terms)
        x = _moved(f, A, now.x, dt, terms)
        P = _propagate(now.P, F, _with_feet(Q, noise, slowness, dt))
        start = _start(p, y, ok, v)
        x = [select(begun, a, b) for a, b in zip(x, start, strict=True)]
        P = [[select(begun, P[i][j], START[i] ** 2 if i == j else 0.0) for j in range(N)] for i in range(N)]
        active = both(1.0, begun + there > 0.5)

        done = Moments(x, P)
        expected, H = _rows(p, rates, done.x, A, v, track["speed_rate"])
        out: Scalars = {}
        base = list(done.x)
        for k, row in enumerate(ROWS):
            fresh = both(ok[row], active)
            value = expected[k]
            for h, a, b in zip(H[k], done.x, base, strict=True):
                if not (isinstance(h, float) and h == 0):
                    value = value + h * (a - b)
            e = select(fresh, y[row] - value, 0.0)
            R = scatter[f"scatter_{row}"] + floors[k] ** 2 if row != "steer_angle" else floors[k] ** 2
            moved, covariance, s = update_row(done.x, done.P, H[k], e, R, fresh)
            done = Moments(moved, covariance)
            out |= {f"{row}_innovation": e, f"{row}_innovation_sd": sqrt(s)}

        x = [select(a > bound, bound, select(a < -bound, -bound, a)) for a, bound in zip(done.x, BOUNDS, strict=True)]
        P = done.P
        gap = select(there, 0.0, carry["gap"] + dt)
        lost = either_of(gap > GAP, x[0] > STEEPEST, x[0] < -STEEPEST)
        keep = both(active, negate(lost))
        x = [select(active, a, 0.0) for a in x]
        variances = [select(P[i][i] > 0, P[i][i], 0.0) for i in range(N)]
        sds = [select(active, sqrt(value), START[i]) for i, value in enumerate(variances)]
        inside = both(carry["tracked"] + ok[SPEED] > 0.5, both(v >= low, v <= high))
        good = both(both(keep, inside), both(both(slowness < 0.5, gap < 0.1), sds[0] < SURE))
        new = {**track, **scatter, **pack(Moments(x, P)), "begun": keep, "gap": gap}
        for i, name in enumerate(OUTPUTS):
            out |= {name: x[i], f"{name}_sd": sds[i]}
        flags = {"slow": 1.0 * (slowness > 0.5), "speed_in_range": inside, "measured": there, "valid": good}
        return {key: new[key] for key in carry}, {**out, **flags}

    carry = {
        **carried(N), "begun": 0.0, "gap": 0.0, "speed": 0.0, "speed_rate": 0.0, "faded": 1.0, "waited": 0.0, "tracked": 0.0,
        **{f"{kind}_{row}": 0.0 for row in ROWS[:5] for kind in ("last", "older", "run")},
        **{f"scatter_{row}": 0.01**2 if k < 3 else 0.2**2 for k, row in enumerate(ROWS[:5])},
    }  # fmt: skip
    outputs = (
        *(o for i, name in enumerate(OUTPUTS) for o in _outputs(name, i)),
        *(
            o
            for row in ROWS
            for o in (
                Output(f"{row}_innovation", quantity(row).unit, "innovation", f"measured {row} less predicted"),
                Output(f"{row}_innovation_sd", quantity(row).unit, "innovation_sd", f"standard deviation of {row}_innovation"),
            )
        ),
        Output("slow", "1", "flag", "1 where feet may be on the ground"),
        Output("speed_in_range", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("measured", "1", "flag", "1 where all needed measurements are fresh"),
        Output("valid", "1", "flag", "1 where speed is in range and not slow, signals come, and roll is sure"),
    )  # fmt: skip
    return Observer(
        "motorcycle-ekf", dt, (), (*ROWS, SPEED), carry, outputs, step, optional=frozenset(ROWS) - set(NEEDED),
        settings={"low": low, "high": high, "terms": terms, "front_crown": p.front_crown, "rear_crown": p.rear_crown,
                  "pneumatic_trail": p.pneumatic_trail},
    )  # fmt: skip


OUTPUTS = ("roll_angle", "steer_angle", "lateral_velocity", "heading_rate", "roll_rate", "steer_rate", "front_lateral_force",
           "rear_lateral_force", "rider_torque", "roll_moment", *EXTRA)  # fmt: skip
_MORE = {
    "heading_rate": ("rad/s", "yaw rate about the road's normal, positive to the left"),
    "pitch_rate_beside_turning": ("rad/s", "pitch rate beside that of the turn"),
}


def _outputs(name: str, index: int) -> tuple[Output, Output]:
    """A state and its standard deviation."""
    if name in _MORE:
        unit, meaning = _MORE[name]
    elif name.endswith("_bias"):
        unit, meaning = quantity(name[:-5]).unit, f"bias of the measured {name[:-5]}"
    else:
        unit, meaning = quantity(name).unit, quantity(name).meaning
    return Output(name, unit, "estimate", meaning), Output(f"{name}_sd", unit, "sd", f"standard deviation of {name}")


def either_of(*flags: Scalar) -> Scalar:
    """1 where one of them is 1."""
    total: Scalar = 0.0
    for flag in flags:
        total = total + flag
    return 1.0 * (total > 0.5)


def _track(carry: Scalars, measured: Scalar, fresh: Scalar, fade: float, dt: float) -> Scalars:
    """Speed and its rate, critically damped; a sample after n ticks counts as n."""
    first = both(fresh, negate(carry["tracked"]))
    faded, waited = carry["faded"] * fade, carry["waited"] + dt
    ahead = carry["speed"] + dt * carry["speed_rate"]
    e = select(fresh, measured - ahead, 0.0)
    speed = ahead + (1 - faded * faded) * e
    rate = carry["speed_rate"] + (1 - faded) * (1 - faded) / waited * e
    held = select(waited > GAP, 0.0, rate)
    return {
        "speed": select(first, measured, speed), "speed_rate": select(first, 0.0, held),
        "faded": select(fresh, 1.0, faded), "waited": select(fresh, 0.0, minimum(waited, 1e3)),
        "tracked": select(fresh, 1.0, carry["tracked"]),
    }  # fmt: skip


def _scatter(carry: Scalars, y: Scalars, ok: Scalars, forget: float) -> Scalars:
    """Variance of a row's samples, from their second differences."""
    new: Scalars = {}
    for row in ROWS[:5]:
        last, older, run = (carry[f"{kind}_{row}"] for kind in ("last", "older", "run"))
        value = select(ok[row], y[row], last)
        bend = value - 2 * last + older
        full = both(ok[row], run > 1.5)
        old = carry[f"scatter_{row}"]
        new[f"scatter_{row}"] = select(full, old + forget * (bend * bend * (1 / 6) - old), old)
        new[f"last_{row}"], new[f"older_{row}"] = value, select(ok[row], last, older)
        new[f"run_{row}"] = select(ok[row], minimum(run + 1.0, 2.0), run)
    return new


def _process(noise: EkfNoise, dt: float) -> list[float]:
    """Variances a tick, apart from feet."""
    white = [0.0, 0.0, noise.lateral, noise.yaw, noise.roll, noise.steer, noise.front, noise.rear, noise.torque]
    come_and_go = [noise.moment * (2 / MOMENT_TIME) ** 0.5, noise.pitch * (2 / PITCH_TIME) ** 0.5]
    walks = [noise.gyro_walk] * 3 + [noise.accelerometer_walk] * 2
    return [s * s * dt for s in (*white, *come_and_go, *walks)]


def _with_feet(Q: Sequence[float], noise: EkfNoise, slowness: Scalar, dt: float) -> list[Scalar]:
    """Variances a tick."""
    Q_now: list[Scalar] = list(Q)
    Q_now[9] = Q[9] + slowness * (noise.feet**2 * 2 / MOMENT_TIME * dt)
    return Q_now


def _pieces(linear: Scalar, x: Sequence[Scalar], v: Scalar, dv: Scalar) -> tuple[list[Scalar], Matrix]:
    """f and A as scalars; structural zeros as the number 0."""
    import casadi as ca

    S, C = _sine_cosine(x[0])
    f, A = linear(ca.vertcat(*x[:LEAN]), v, dv, S, C)
    return [f[i] for i in range(MOVING)], [[_entry(A, i, j) for j in range(LEAN)] for i in range(MOVING)]


def _entry(A: Scalar, i: int, j: int) -> Scalar:
    """An entry, a number where it is one."""
    value = A[i, j]
    return float(value) if value.is_constant() else value


def _sine_cosine(roll: Scalar) -> tuple[Scalar, Scalar]:
    import casadi as ca

    return ca.sin(roll), ca.cos(roll)


def _dot(pairs: Sequence[tuple[Scalar, Scalar]]) -> Scalar:
    """Sum of products, without those that are 0."""
    total: Scalar = 0.0
    for a, b in pairs:
        if (isinstance(a, float) and a == 0) or (isinstance(b, float) and b == 0):
            continue
        total = a * b if isinstance(total, float) and total == 0 else total + a * b
    return total


def _transition(A: Matrix, dt: float, terms: int) -> Matrix:
    """exp of the whole, shape (16, 16)."""
    term = [[_scaled(a, dt) for a in row] for row in A]
    total = [list(row) for row in term]
    for k in range(2, terms + 1):
        term = [[_scaled(_dot([(A[i][n], term[n][j]) for n in range(MOVING)]), dt / k) for j in range(LEAN)] for i in range(MOVING)]
        total = [[_plus(a, b) for a, b in zip(r, s, strict=True)] for r, s in zip(total, term, strict=True)]
    F: Matrix = [[1.0 if i == j else 0.0 for j in range(N)] for i in range(N)]
    for i in range(MOVING):
        for j in range(LEAN):
            F[i][j] = _plus(total[i][j], 1.0 if i == j else 0.0)
    F[9][9], F[10][10] = float(np.exp(-dt / MOMENT_TIME)), float(np.exp(-dt / PITCH_TIME))
    return F


def _scaled(a: Scalar, factor: float) -> Scalar:
    return a * factor


def _plus(a: Scalar, b: Scalar) -> Scalar:
    if isinstance(a, float) and a == 0:
        return b
    return a if isinstance(b, float) and b == 0 else a + b


def _moved(f: Sequence[Scalar], A: Matrix, x: Sequence[Scalar], dt: float, terms: int) -> list[Scalar]:
    """The state a tick on."""
    term = [a * dt for a in f]
    total = list(term)
    for k in range(2, terms + 1):
        term = [_dot([(A[i][n], term[n]) for n in range(MOVING)]) * (dt / k) for i in range(MOVING)]
        total = [a + b for a, b in zip(total, term, strict=True)]
    fades = {9: float(np.exp(-dt / MOMENT_TIME)), 10: float(np.exp(-dt / PITCH_TIME))}
    return [x[i] + total[i] if i < MOVING else x[i] * fades.get(i, 1.0) for i in range(N)]


def _propagate(P: Matrix, F: Matrix, Q: Sequence[Scalar]) -> Matrix:
    """F P F' + Q by its upper triangle."""
    FP = [[_dot([(F[i][k], P[k][j]) for k in range(N)]) for j in range(N)] for i in range(N)]
    new: Matrix = [[0.0] * N for _ in range(N)]
    for i in range(N):
        for j in range(i, N):
            value = _dot([(F[j][k], FP[i][k]) for k in range(N)])
            new[i][j] = new[j][i] = value + Q[i] if i == j else value
    return new


def _start(p: LeanParameters, y: Scalars, ok: Scalars, v: Scalar) -> list[Scalar]:
    """The state at the first tick."""
    import casadi as ca

    q = p.sharp
    given = {row: select(ok[row], y[row], 0.0) for row in ROWS}
    lean = (given["lateral_acceleration"] - v * given["yaw_rate"]) * (1 / q.g)
    held = select(lean > 0.95, 0.95, select(lean < -0.95, -0.95, lean))
    roll = ca.asin(held)
    turn = given["yaw_rate"] / sqrt(1 - held * held)
    side = q.mass * v * turn
    share = q.load / (q.mass * q.g)
    x: list[Scalar] = [0.0] * N
    x[0], x[1], x[3], x[4] = roll, given["steer_angle"], turn, given["roll_rate"]
    x[6], x[7] = side * share, side * (1 - share)
    return x


def _rows(
    p: LeanParameters, rates: Scalar, x: Sequence[Scalar], A: Matrix, v: Scalar, dv: Scalar
) -> tuple[list[Scalar], Matrix]:
    """What the rows should show, and the derivatives: those of the accelerations are A's, of the last estimate."""
    import casadi as ca

    X, n, Z = p.imu
    rho, g = p.crown(X), p.sharp.g
    S, C = _sine_cosine(x[0])
    f = rates(ca.vertcat(*x[:LEAN]), v, dv, S, C)
    z, a, s, c = ca.SX.sym("z", N), ca.SX.sym("a", 3), ca.SX.sym("s"), ca.SX.sym("c")
    W, w = z[3], z[4]
    swing, lift = a[2] * c - w * w * s, a[2] * s + w * w * c
    side = a[0] + v * W + X * a[1] - Z * swing - n * lift + W * W * (Z * s - n * c)
    up = (rho - Z) * lift + n * swing + g
    rows = ca.vertcat(
        w + z[11], z[10] + W * s + z[12], W * c + z[13], side * c + up * s + z[14], up * c - side * s + z[15], z[1]
    )
    by_state = ca.jacobian(rows, z)
    turned = ca.jacobian(rows, s) * c - ca.jacobian(rows, c) * s
    by_state = ca.horzcat(by_state[:, 0] + turned, by_state[:, 1:])
    by_rate = ca.jacobian(rows, a)
    args = [z, a, s, c]
    values = [ca.vertcat(*x), f[2:5], S, C]
    expected, direct, through = ca.substitute([rows, by_state, by_rate], args, values)
    H: Matrix = []
    for k in range(len(ROWS)):
        line: list[Scalar] = []
        for j in range(N):
            total = _entry(direct, k, j)
            if j < LEAN:
                total = _plus(total, _dot([(_entry(through, k, i), A[2 + i][j]) for i in range(3)]))
            line.append(total)
        H.append(line)
    return [expected[k] for k in range(len(ROWS))], H


def _terms(linear: Scalar, dt: float, high: float) -> int:
    """How many terms of the series a tick needs, at speeds to a quarter beyond the range.

    Raises:
        DesignError: too many.
    """
    from scipy.linalg import expm

    scale = np.array([1.0, 0.1, 1, 1, 1, 1, 300, 300])
    closed = []
    for v in (0.0, high, 1.25 * high):
        for roll in (0.0, 0.6):
            x = np.zeros(LEAN)
            x[0] = roll
            A = np.array(linear(x, v, 0.0, np.sin(roll), np.cos(roll))[1])[:, :MOVING]
            closed.append(A * scale / scale[:, None] * dt)
    for terms in range(2, TERMS + 1):
        worst = max(np.abs(_series(M, terms) - expm(M)).max() / np.abs(expm(M)).max() for M in closed)
        if worst < CLOSE:
            return terms
    raise DesignError(
        f"a tick of {dt:g} s at {1.25 * high:g} m/s", f"a transition exact to {CLOSE:g} within {TERMS} terms",
        "a shorter tick",
    )  # fmt: skip


def _series(M: Array, terms: int) -> Array:
    total, term = np.eye(len(M)), np.eye(len(M))
    for k in range(1, terms + 1):
        term = term @ M / k
        total = total + term
    return total
