"""The motorcycle's large-angle extended Kalman filter on the raw signals of an IMU, a steering encoder and a speed.

    x = (phi, delta, v_y, W, phi', delta', Y_f, Y_r, tau, M_phi, theta', b_p, b_q, b_r, b_y, b_z)

The first eight move as `models.motorcycle_lean` says, at any lean; the rider's torque tau walks. M_phi, N m, is a moment about the
road that nothing else explains: a leaning rider, a side wind, feet on the ground. theta' is a pitch rate that comes and goes within
`PITCH_TIME`. The biases of gyroscope and accelerometer walk slowly. In body axes (ISO 8855) the IMU at (X, n, Z) shows

    p = phi' + b_p,   q = theta' + W sin phi + b_q,   r = W cos phi + b_r
    f_y = a_y cos phi + (a_z + g) sin phi + b_y,      f_z = -a_y sin phi + (a_z + g) cos phi + b_z
    a_y = v_y' + v W + X W' - Z (phi'' cos phi - phi'^2 sin phi) - n (phi'' sin phi + phi'^2 cos phi) + W^2 (Z sin phi - n cos phi)
    a_z = (rho - Z)(phi'' sin phi + phi'^2 cos phi) + n (phi'' cos phi - phi'^2 sin phi)

with v_y', W', phi'' from the model, so that what the tyres do is told by the accelerometer. No acceleration is squared away, no
turn is taken as balanced, no pitch rate as zero.

**Tick.** x+ = x + (dt + A dt^2/2 + ...) f(x), F = 1 + A dt + A^2 dt^2/2 + ... with A at the last estimate, as many terms as the
tick needs up to the greatest speed. Rows one at a time, where fresh. v and v' come from the speed by `track_speed`.

**Start** once everything needed came within `STALE` s, at sin phi = (f_y - v r) / g: exact in a steady turn at any lean, and at
rest. A gap of `GAP` s, or a roll beyond `STEEPEST`, starts it anew.

**Noise.** What a sensor's samples scatter by is learnt from their second differences (`learn_scatter`), beside a floor for what
the model leaves out. The model's own noise is `EkfNoise`; its defaults were chosen so that bands cover machines that are told wrong
(docs/motorcycle.md).

**Slow.** Below `SLOW` m/s feet may be on the ground, so that M_phi may be anything: roll is then gyroscope's and gravity's. `slow`
is 1 there, `speed_in_range` 0 outside the speeds given; `valid` is 1 where the speed is in range and not slow, signals come, and
the roll's standard deviation is below `SURE`.

Sharp 1971 and Cossalter 2006 as in `motorcycle_lean`; the filter: Jazwinski 1970 (Stochastic Processes and Filtering Theory), 8.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.kernel import Scalar, both, negate, select, sqrt
from codriver.models.motorcycle_lean import LEAN_STATES, LeanParameters, lean_functions
from codriver.names import quantity
from codriver.observers.arrivals import all_came, arrivals_carry, note_arrivals
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import Matrix, update_row
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.sample_scatter import learn_scatter, scatter_carry
from codriver.observers.scaled_gain import check_tick
from codriver.observers.series import series, terms_needed
from codriver.observers.speed_tracker import CARRY as SPEED_CARRY
from codriver.observers.speed_tracker import track_speed
from codriver.signals.signal import Array

DEGREE = np.pi / 180
SPEED = "longitudinal_speed"
IMU = ("roll_rate", "pitch_rate", "yaw_rate", "lateral_acceleration", "vertical_acceleration")
ROWS = (*IMU, "steer_angle")
OPTIONAL = frozenset({"pitch_rate", "vertical_acceleration"})
NEEDED = tuple(name for name in (*ROWS, SPEED) if name not in OPTIONAL)
# The states in their order, by the names of the outputs.
STATES = (
    "roll_angle", "steer_angle", "lateral_velocity", "heading_rate", "roll_rate", "steer_rate", "front_lateral_force",
    "rear_lateral_force", "rider_torque", "roll_moment", "pitching", *(f"{row}_bias" for row in IMU),
)  # fmt: skip
N, MOVING, LEAN = len(STATES), 8, len(LEAN_STATES)
ROLL, TURN, LEANING, MOMENT, PITCHING, BIASES = 0, 3, 4, 9, 10, 11
PITCH_TIME, MOMENT_TIME, TILT_TIME, HEAVE_TIME = 0.2, 0.5, 0.5, 0.2  # s
RATE = 100.0  # Hz, at which the floors of the rows are told
TILTED = {"roll_rate": TURN, "yaw_rate": LEANING}  # rows that see another rate where the machine is pitched
TRACKING, SCATTER_TIME = 4.0, 2.0  # rad/s, s
GAP, STALE = 1.0, 0.25  # s
SLOW = (2.0, 4.0)  # m/s: all of it below the first, none above the second
STEEPEST, SURE = 1.35, 3 * DEGREE
CLOSE, TERMS = 1e-3, 12
# What states cannot exceed, so that nonsense stays finite; standard deviations at the start. Units of STATES.
BOUNDS = (STEEPEST + 0.1, 1.0, 20.0, 6.0, 10.0, 30.0, 2e4, 2e4, 1e3, 5e3, 3.0, 1.0, 1.0, 1.0, 5.0, 5.0)
START = (0.15, 0.05, 0.5, 0.2, 0.3, 0.5, 300.0, 300.0, 30.0, 50.0, 0.05, 0.01, 0.01, 0.01, 0.25, 0.25)
SCATTER = dict(zip(IMU, (0.05, 0.05, 0.05, 1.0, 1.0), strict=True))  # rad/s, m/s^2, until learnt


@dataclass(frozen=True)
class EkfNoise:
    """What the model leaves out.

    Attributes:
        lateral, yaw, roll, steer: white noise of the accelerations, m/s^2, rad/s^2 per sqrt(Hz).
        tyre: of the tyre forces' rates, N/s per sqrt(Hz).
        torque: of the rider's torque's rate, N m/s per sqrt(Hz).
        moment, feet: sd of M_phi, N m, when riding and what is added when slow.
        pitch: sd of theta', rad/s.
        tilt: sd of the pitch angle, rad, which turns p by W and r by phi' times itself, for `TILT_TIME` seconds.
        gyro_walk, accelerometer_walk: of the biases, rad/s and m/s^2 per sqrt(s).
        share: systematic error of the roll in parts of it, which is told in its standard deviation and not carried.
        heave: error of the vertical acceleration of a lean, which springs take up, in parts of it, for `HEAVE_TIME` seconds.
        gyro, lateral_force, vertical_force, encoder: floors of the rows' sd, rad/s, m/s^2, rad, for errors that are independent at
            `RATE`.
    """

    lateral: float = 0.05
    yaw: float = 0.06
    roll: float = 0.06
    steer: float = 0.4
    tyre: float = 400.0
    torque: float = 25.0
    moment: float = 20.0
    feet: float = 600.0
    pitch: float = 0.03
    gyro_walk: float = 0.0005
    accelerometer_walk: float = 1e-3
    share: float = 0.015
    heave: float = 0.3
    tilt: float = 0.012
    gyro: float = 0.003
    lateral_force: float = 0.03
    vertical_force: float = 0.22
    encoder: float = 0.0005

    def process(self) -> Array:
        """Intensities of the states, shape (16,)."""
        white = [0.0, 0.0, self.lateral, self.yaw, self.roll, self.steer, self.tyre, self.tyre, self.torque]
        come_and_go = [self.moment * (2 / MOMENT_TIME) ** 0.5, self.pitch * (2 / PITCH_TIME) ** 0.5]
        return np.square([*white, *come_and_go, *[self.gyro_walk] * 3, *[self.accelerometer_walk] * 2])

    def floors(self, dt: float) -> dict[str, float]:
        """Least variance of a tick's sample, by row."""
        sds = [self.gyro] * 3 + [self.lateral_force, self.vertical_force, self.encoder]
        return {row: sd * sd / (RATE * dt) for row, sd in zip(ROWS, sds, strict=True)}


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
    import casadi as ca

    check_tick(dt)
    noise = noise or EkfNoise()
    rates, linear = lean_functions(p)
    show = sensor_function(p)
    terms = _terms(linear, dt, high)
    Q, floors = noise.process(), noise.floors(dt)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        came = note_arrivals(carry, NEEDED, y, ok, dt)
        begun, active = carry["begun"], select(carry["begun"], 1.0, all_came(came, NEEDED, STALE))
        track = track_speed(carry, y[SPEED], ok[SPEED], TRACKING, dt)
        scatter = learn_scatter(carry, IMU, y, ok, SCATTER_TIME, dt)
        v, dv = track["speed"], track["speed_rate"]
        slowness = select(v < SLOW[0], 1.0, select(v > SLOW[1], 0.0, (SLOW[1] - v) / (SLOW[1] - SLOW[0])))

        now = unpack(carry, N)
        x: Scalar = ca.vertcat(*now.x)
        P: Scalar = ca.vertcat(*[ca.horzcat(*row) for row in now.P])
        f, A = linear(x[:LEAN], v, dv, ca.sin(x[0]), ca.cos(x[0]))
        whole = ca.SX(N, N)
        whole[:MOVING, :LEAN] = A
        whole[MOMENT, MOMENT], whole[PITCHING, PITCHING] = -1 / MOMENT_TIME, -1 / PITCH_TIME
        rate = ca.vertcat(f, 0, -x[MOMENT] / MOMENT_TIME, -x[PITCHING] / PITCH_TIME, ca.SX(N - BIASES, 1))
        F = ca.SX.eye(N) + series(whole, whole, dt, terms)
        spread = ca.SX(ca.DM(Q * dt))
        spread[MOMENT] += slowness * (noise.feet**2 * 2 / MOMENT_TIME * dt)
        moved, P = x + series(whole, rate, dt, terms), F @ P @ F.T + ca.diag(spread)
        start = _start(p, came, v)
        found = [select(begun, moved[i], start[i]) for i in range(N)]
        apart: Matrix = [[0.0 if i != j else START[i] ** 2 for j in range(N)] for i in range(N)]
        apart[MOMENT][MOMENT] += slowness * noise.feet**2
        covariance = [[select(begun, P[min(i, j), max(i, j)], apart[i][j]) for j in range(N)] for i in range(N)]

        # What the rows should show; the accelerations' derivatives are those at the last estimate.
        x = ca.vertcat(*found)
        S, C = ca.sin(x[0]), ca.cos(x[0])
        expected, H, heave = show(x, rates(x[:LEAN], v, dv, S, C)[2:5], A[2:5, :], v, S, C)
        done = Moments(found, covariance)
        out: Scalars = {}
        for k, row in enumerate(ROWS):
            fresh = both(ok[row], begun)  # the sample that it starts from is not taken twice
            value = expected[k] + sum(H[k, i] * (done.x[i] - found[i]) for i in range(N))
            e = select(fresh, y[row] - value, 0.0)
            R = floors[row] + (scatter[f"scatter_{row}"] if row in IMU else 0.0)
            if row in TILTED:
                seen = noise.tilt * found[TILTED[row]]
                R = R + seen * seen * (2 * TILT_TIME / dt)
            if row == "vertical_acceleration":
                R = R + (noise.heave * heave) ** 2 * (2 * HEAVE_TIME / dt)
            mean, covariance, s = update_row(done.x, done.P, [H[k, i] for i in range(N)], e, R, fresh)
            done = Moments(mean, covariance)
            out |= {f"{row}_innovation": e, f"{row}_innovation_sd": sqrt(s)}

        bounded = [select(a > b, b, select(a < -b, -b, a)) for a, b in zip(done.x, BOUNDS, strict=True)]
        estimate = [select(active, a, 0.0) for a in bounded]
        variances = [select(done.P[i][i] > 0, done.P[i][i], 0.0) for i in range(N)]
        systematic = noise.share * estimate[ROLL]
        variances[ROLL] = variances[ROLL] + systematic * systematic
        sds = [select(active, sqrt(variance), sd) for variance, sd in zip(variances, START, strict=True)]
        lean = select(estimate[ROLL] < 0, -estimate[ROLL], estimate[ROLL])
        keep = both(active, both(all_came(came, NEEDED, GAP), lean < STEEPEST))
        inside = both(track["speed_known"], both(v >= low, v <= high))
        sure = both(both(all_came(came, NEEDED, STALE), sds[ROLL] < SURE), both(inside, negate(slowness > 0)))
        new = {**pack(Moments(estimate, done.P)), "begun": keep, **came, **track, **scatter}
        for name, value, sd in zip(STATES, estimate, sds, strict=True):
            out |= {name: value, f"{name}_sd": sd}
        flags = {"slow": slowness > 0, "speed_in_range": inside, "valid": both(keep, sure)}
        return {key: new[key] for key in begin}, out | flags

    begin = {**carried(N), "begun": 0.0, **arrivals_carry(NEEDED), **SPEED_CARRY, **scatter_carry(SCATTER)}
    return Observer(
        "motorcycle-ekf", dt, (), (*ROWS, SPEED), begin, _outputs(low, high), step, optional=OPTIONAL,
        settings={"low": low, "high": high, "terms": terms, "front_crown": p.front_crown, "rear_crown": p.rear_crown,
                  "pneumatic_trail": p.pneumatic_trail},
    )  # fmt: skip


def _start(p: LeanParameters, came: Scalars, v: Scalar) -> list[Scalar]:
    """The state at the first tick: a steady turn, or rest."""
    import casadi as ca

    q = p.sharp
    given = {name: came[f"latest_{name}"] for name in NEEDED}
    lean = (given["lateral_acceleration"] - v * given["yaw_rate"]) / q.g
    held = select(lean > 0.95, 0.95, select(lean < -0.95, -0.95, lean))
    turn = given["yaw_rate"] / sqrt(1 - held * held)
    share, side = q.load / (q.mass * q.g), q.mass * v * turn
    known = {
        "roll_angle": ca.asin(held), "steer_angle": given["steer_angle"], "heading_rate": turn,
        "roll_rate": given["roll_rate"], "front_lateral_force": side * share, "rear_lateral_force": side * (1 - share),
    }  # fmt: skip
    return [known.get(name, 0.0) for name in STATES]


def sensor_function(p: LeanParameters) -> Scalar:
    """CasADi function of what the sensors should show, h(x), as the module's docstring writes it, and H = dh/dx.

    It is (x, a, bent, v, sin phi, cos phi) -> (h, H, a_z): a = (v_y', W', phi''), bent its derivatives by the first ten states,
    shape (3, 10); h as `ROWS`, rad/s, m/s^2, rad, shape (6, 1), H of shape (6, 16), a_z in m/s^2.
    """
    import casadi as ca

    X, n, Z = p.imu
    rho, g = p.crown(X), p.sharp.g
    x, a, bent = ca.SX.sym("x", N), ca.SX.sym("a", 3), ca.SX.sym("bent", 3, LEAN)
    v, S, C = (ca.SX.sym(name) for name in ("v", "S", "C"))
    W, w, b = x[TURN], x[LEANING], x[BIASES:]
    swing, lift = a[2] * C - w * w * S, a[2] * S + w * w * C
    side = a[0] + v * W + X * a[1] - Z * swing - n * lift + W * W * (Z * S - n * C)
    up = (rho - Z) * lift + n * swing + g
    rows = ca.vertcat(
        w + b[0], x[PITCHING] + W * S + b[1], W * C + b[2], side * C + up * S + b[3], up * C - side * S + b[4], x[1]
    )
    H = ca.jacobian(rows, x)
    H[:, ROLL] += ca.jacobian(rows, S) * C - ca.jacobian(rows, C) * S
    H[:, :LEAN] += ca.jacobian(rows, a) @ bent
    return ca.Function("show", [x, a, bent, v, S, C], [rows, H, up - g])


def _terms(linear: Scalar, dt: float, high: float) -> int:
    """Terms that a tick needs at rest and up to a quarter beyond the greatest speed."""
    scale = np.array([1.0, 0.1, 1, 1, 1, 1, 300, 300])
    closed = []
    for v in (0.0, high, 1.25 * high):
        for roll in (0.0, 0.6):
            A = np.array(linear([roll, *[0.0] * (LEAN - 1)], v, 0.0, np.sin(roll), np.cos(roll))[1])[:, :MOVING]
            closed.append(A * scale / scale[:, None])
    return terms_needed(closed, dt, CLOSE, TERMS)


def _outputs(low: float, high: float) -> tuple[Output, ...]:
    """All outputs."""
    outputs = []
    for name in STATES:
        unit = quantity(name.removesuffix("_bias")).unit
        meaning = f"bias of {name[:-5]}" if name.endswith("_bias") else quantity(name).meaning
        outputs += [
            Output(name, unit, "estimate", meaning),
            Output(f"{name}_sd", unit, "sd", f"standard deviation of {name}"),
        ]
    for row in ROWS:
        unit, name = quantity(row).unit, f"{row}_innovation"
        outputs += [
            Output(name, unit, "innovation", f"measured {row} less predicted; 0 where none arrived"),
            Output(f"{name}_sd", unit, "innovation_sd", f"standard deviation of {name}"),
        ]
    return (
        *outputs,
        Output("slow", "1", "flag", "1 where it is so slow that feet may be on the ground"),
        Output("speed_in_range", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("valid", "1", "flag", "1 where the speed is in range, signals come, and the roll is known to 3 degrees"),
    )
