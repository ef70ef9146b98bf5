"""Roll and rider's torque of a bicycle: Kalman filter on the Whipple bicycle, whose matrices follow the speed.

    x' = A(v) x + w,   x = (phi, delta, phi', delta', T, m, b, d),          A(v) = A_0 + v A_1 + v^2 A_2
    T' = w_T,   m' = -m / T_m + w_m,   b' = w_b,   d' = w_d
    rows      delta + d,   phi' + b,   r = (v delta + c delta') cos(lambda) / w,   or 0 = delta where no yaw rate comes

phi roll, delta steer, rad; T the rider's torque, N m, a random walk; m a roll moment that nobody measures (pull, wind, upper body),
N m; b bias of the gyroscope, rad/s; d zero of the encoder, rad; w wheelbase, c trail, m, lambda tilt of the steer axis. ISO 8855.
The roll angle is no row. It is seen in the first equation of motion, as the lean at which the bicycle with this steer and speed
would move as it does; a lasting m cannot be told from a lean, so m forgets itself in T_m, and its size is a lean's: sd `moment`
times the moment that gravity has per rad.

The encoder's zero is found by the yaw rate. Without one, the ride is taken to go straight on the average: delta is white noise
of intensity `straight`, by which zero and roll settle within some tens of seconds. A long bend without a yaw rate is then taken for
a wrong zero, and makes a wrong roll that the band does not show. With `friction` T_c tanh(delta' / 0.05 rad/s) is added to T, as
in `models.steer_row`. The scatter of the gyroscope's samples is learnt (`learn_scatter`).

Meijaard, Papadopoulos, Ruina, Schwab 2007, doi:10.1098/rspa.2007.1857; Kalman 1960, doi:10.1115/1.3662552.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos

import numpy as np

from codriver.kernel import Scalar, both, minimum, negate, select, sqrt
from codriver.models.bicycle import BicycleMatrices, BicycleParameters, bicycle_lpv, bicycle_matrices
from codriver.models.lpv import LPV
from codriver.models.steer_row import SLIDING
from codriver.names import quantity
from codriver.observers.arrivals import all_came, arrivals_carry, note_arrivals
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import Matrix, predict_covariance, predict_mean, update_row
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.sample_scatter import learn_scatter, scatter_carry
from codriver.observers.scaled_gain import check_tick
from codriver.observers.series import series, terms_needed
from codriver.signals.signal import Array

SPEED = "longitudinal_speed"
NEEDED = ("steer_angle", "roll_rate")
SENSED = (*NEEDED, "yaw_rate")
GYRO = ("roll_rate", "yaw_rate")
STATES = (
    "roll_angle", "steer_angle", "roll_rate", "steer_rate", "rider_torque", "roll_moment", "roll_rate_bias", "steer_offset",
)  # fmt: skip
OWN = {
    "roll_rate_bias": ("rad/s", "bias of roll_rate"),
    "steer_offset": ("rad", "what steer_angle shows straight ahead"),
}
RANGE = (1.5, 12.0)  # m/s
GAP, STALE, SETTLE = 1.0, 0.25, 5.0  # s
SCATTER, SCATTER_TIME = dict.fromkeys(GYRO, 0.05), 2.0  # rad/s until learnt, s
SURE = 5 * np.pi / 180
CLOSE, TERMS = 1e-5, 14
MOST = 1e4  # of any state, so that nonsense stays finite
SIZES = np.array([0.1, 0.05, 0.5, 0.5, 2.0, 10.0, 0.02, 0.02])


@dataclass(frozen=True)
class BicycleNoise:
    """What the bicycle and its sensors leave out.

    Attributes:
        roll, steer: white noise of the accelerations, rad/s^2 per sqrt(Hz).
        torque: of the rider's torque's rate, N m/s per sqrt(Hz).
        moment: sd of m, as a lean, rad.
        lasting: T_m, s.
        walk, creep: of the gyroscope's bias, rad/s, and of the encoder's zero, rad, per sqrt(s).
        encoder, gyro, turn: sd of a sample of the rows at `rate`, rad, rad/s, rad/s; the gyroscope's scatter comes on top.
        straight: intensity of delta on a ride that goes straight on the average, rad^2 s.
        share: systematic error of the roll in parts of it.
        bias: of the yaw rate, rad/s, which nothing here finds.
        rate: at which samples err independently, Hz.
        bias_start, offset_start: sd of b, rad/s, and of d, rad, at the start.
    """

    roll: float = 0.02
    steer: float = 0.4
    torque: float = 5.0
    moment: float = 0.05
    lasting: float = 0.25
    walk: float = 1e-4
    creep: float = 1e-5
    encoder: float = 0.001
    gyro: float = 0.05
    turn: float = 0.05
    straight: float = 0.0025
    share: float = 0.06
    bias: float = 0.006
    rate: float = 100.0
    bias_start: float = 0.03
    offset_start: float = 0.02

    def process(self, arm: float) -> Array:
        """Intensities of the states, shape (8,).

        Args:
            arm: roll moment of gravity per rad, N m.
        """
        m = 2 * (self.moment * arm) ** 2 / self.lasting
        w = [self.roll**2, self.steer**2, self.torque**2, m, self.walk**2, self.creep**2]
        return np.array([0.0, 0.0, *w])

    def start(self, arm: float) -> Array:
        """Variances at the start, shape (8,)."""
        return np.square([0.15, 0.05, 0.3, 0.5, 3.0, self.moment * arm, self.bias_start, self.offset_start])


def augmented_bicycle(matrices: BicycleMatrices, lasting: float) -> LPV:
    """The bicycle with torque, moment, bias and zero as states.

    Args:
        matrices: in ISO axes.
        lasting: T_m, s.
    """
    plain = bicycle_lpv(matrices)
    powers = {k: np.pad(A, (0, 4)) for k, A in plain.powers.items()}
    powers[0][:4, 4], powers[0][:4, 5] = plain.B[:, 1], plain.B[:, 0]
    powers[0][5, 5] = -1 / lasting
    C = np.zeros((2, 8))
    C[0, [1, 7]] = C[1, [2, 6]] = 1
    return LPV(powers, np.zeros((8, 0)), C, STATES, (), NEEDED)


def bicycle_kalman(
    p: BicycleParameters, dt: float = 0.01, *, low: float = RANGE[0], high: float = RANGE[1], friction: float = 0.0,
    noise: BicycleNoise | None = None,
) -> Observer:  # fmt: skip
    """The filter.

    Args:
        p: bicycle with its rider.
        dt: tick, s.
        low, high: range of speed, m/s.
        friction: T_c, N m.
        noise: of bicycle and sensors.

    Raises:
        UsageError: a tick that cannot be.
        DesignError: a tick too long for this bicycle.
    """
    check_tick(dt)
    noise = noise or BicycleNoise()
    matrices = bicycle_matrices(p).to_iso()
    model = augmented_bicycle(matrices, noise.lasting)
    arm = -matrices.g * float(matrices.K0[0, 0])
    Q, wide = np.diag(noise.process(arm) * dt).tolist(), noise.start(arm)
    scaled = {k: A * SIZES / SIZES[:, None] for k, A in model.powers.items()}
    terms = terms_needed([sum(v**k * A for k, A in scaled.items()) for v in (low, 1.25 * high)], dt, CLOSE, TERMS)
    n, share, turns = len(STATES), 1 / (noise.rate * dt), cos(p.lam) / p.w

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        import casadi as ca

        v = select(ok[SPEED], rho[SPEED], carry["speed"])
        came = note_arrivals(carry, SENSED, y, ok, dt)
        there = both(ok[SPEED], all_came(came, NEEDED, STALE))
        begun, active = carry["begun"], select(carry["begun"], 1.0, there)
        learnt = learn_scatter(carry, GYRO, y, ok, SCATTER_TIME, dt)

        A = sum((ca.SX(ca.DM(matrix)) * v**k for k, matrix in model.powers.items()), ca.SX(n, n))
        F = ca.SX.eye(n) + series(A, A, dt, terms)
        F = [[F[i, j] for j in range(n)] for i in range(n)]
        now = unpack(carry, n)
        steer = came["latest_steer_angle"]
        start = {0: v * v * steer * (-turns / matrices.g), 1: steer, 2: came["latest_roll_rate"]}
        moved, P = predict_mean(now.x, F), predict_covariance(now.P, F, Q)
        x = [select(begun, moved[i], start.get(i, 0.0)) for i in range(n)]
        P = [[select(begun, P[i][j], float(wide[i]) if i == j else 0.0) for j in range(n)] for i in range(n)]

        turn = [0.0, v * turns, 0.0, p.c * turns, 0.0, 0.0, 0.0, 0.0]
        blind = both(came["since_yaw_rate"] > GAP, both(v > low, active))
        rows: Mapping[str, tuple[list[Scalar], Scalar, Scalar, Scalar]] = {
            # The sample that it starts from is not taken twice.
            "steer_angle": (model.C[0].tolist(), y["steer_angle"], noise.encoder**2 * share, both(begun, ok["steer_angle"])),
            "roll_rate": (
                model.C[1].tolist(), y["roll_rate"], noise.gyro**2 * share + learnt["scatter_roll_rate"],
                both(begun, ok["roll_rate"]),
            ),
            "yaw_rate": (
                turn, y["yaw_rate"], noise.turn**2 * share + learnt["scatter_yaw_rate"], both(active, ok["yaw_rate"]),
            ),
            "straight": ([0.0, 1.0, *[0.0] * 6], 0.0, noise.straight / dt, blind),
        }  # fmt: skip
        out: Scalars = {}
        for name, (row, value, R, fresh) in rows.items():
            e = select(fresh, value - predict_mean(x, [row])[0], 0.0)
            x, P, s = update_row(x, P, row, e, R, fresh)
            if name in SENSED:
                out |= {f"{name}_innovation": e, f"{name}_innovation_sd": sqrt(s), f"{name}_used": fresh}
        x = [select(active, select(a > MOST, MOST, select(a < -MOST, -MOST, a)), 0.0) for a in x]
        variances = [select(P[i][i] > 0, P[i][i], 0.0) for i in range(n)]
        told, unseen = noise.share * x[0], (noise.bias / matrices.g) * v
        variances[0] = variances[0] + told * told + unseen * unseen
        felt = list(x)
        felt[4] = x[4] + friction * ca.tanh(x[3] * (1 / SLIDING)) if friction else x[4]
        for i, name in enumerate(STATES):
            out |= {name: felt[i], f"{name}_sd": sqrt(variances[i])}
        out |= _heading(x, P, turn)

        dark = select(ok[SPEED], 0.0, minimum(carry["dark"] + dt, 2 * GAP))
        keep = both(active, both(dark < GAP, all_came(came, NEEDED, GAP)))
        inside = both(ok[SPEED], both(v >= low, v <= high))
        since = select(both(keep, both(there, inside)), minimum(carry["since"] + dt, 2 * SETTLE), 0.0)
        valid = both(both(inside, since > SETTLE), out["roll_angle_sd"] < SURE)
        out |= {"speed_in_range": inside, "turn_measured": negate(came["since_yaw_rate"] > GAP), "valid": valid}
        new = {**pack(Moments(x, P)), **learnt, **came, "speed": v, "begun": keep, "dark": dark, "since": since}
        return {key: new[key] for key in begin}, out

    begin = {
        **carried(n), **scatter_carry(SCATTER), **arrivals_carry(SENSED), "speed": low, "begun": 0.0, "dark": 0.0, "since": 0.0,
    }  # fmt: skip
    return Observer(
        "bicycle-kalman", dt, (), SENSED, begin, _outputs(low, high), step, scheduling=(SPEED,), optional=frozenset({"yaw_rate"}),
        settings={"low": low, "high": high, "friction": friction, "terms": terms},
    )  # fmt: skip


def _heading(x: list[Scalar], P: Matrix, row: list[Scalar]) -> Scalars:
    """Yaw rate by the wheels, and its standard deviation."""
    seen = (1, 3)
    variance = sum(row[i] * row[j] * P[i][j] for i in seen for j in seen)
    return {"heading_rate": predict_mean(x, [row])[0], "heading_rate_sd": sqrt(select(variance > 0, variance, 0.0))}


def _outputs(low: float, high: float) -> tuple[Output, ...]:
    """All outputs."""
    outputs = []
    for name in (*STATES, "heading_rate"):
        unit, meaning = OWN.get(name) or (quantity(name).unit, quantity(name).meaning)
        outputs += [
            Output(name, unit, "estimate", meaning),
            Output(f"{name}_sd", unit, "sd", f"standard deviation of {name}"),
        ]
    for name in SENSED:
        unit = quantity(name).unit
        outputs += [
            Output(f"{name}_innovation", unit, "innovation", f"{name} less predicted; 0 where none arrived"),
            Output(f"{name}_innovation_sd", unit, "innovation_sd", f"standard deviation of {name}_innovation"),
            Output(f"{name}_used", "1", "flag", f"1 where a value of {name} was used"),
        ]
    return (
        *outputs,
        Output("speed_in_range", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("turn_measured", "1", "flag", "1 where yaw rates come; 0: the ride is taken as straight on the average"),
        Output(
            "valid",
            "1",
            "flag",
            "1 where signals have come for a while, at a speed in range, and roll is known to 5 degrees",
        ),
    )
