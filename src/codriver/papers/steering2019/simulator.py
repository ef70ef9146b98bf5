"""2019 section 4.2, the lab: weights hung on the wheel (89), the wheel identified by a chirp (90)-(91), and the sign of (92).

The Georgia Tech Driving Simulator's recordings were never published. A simulated rig stands in for it: the wheel of (90), with and
without 0.15 N m of friction, an encoder of 0.1 degree, commands in the device's own unit, files as a simulator writes them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from codriver.identify import SteeringFit, TorqueScale, identify_steering_wheel, identify_torque_scale
from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_joint import JointSettings
from codriver.identify.steering_passes import Passes, algorithm_1
from codriver.identify.steering_ukf import joint_ukf
from codriver.identify.torque_scale import read_weighings
from codriver.logs import read
from codriver.papers.item import Item, near
from codriver.papers.reproduction import Chapter
from codriver.papers.steering2019.runs import ANGLE, B_S, J_S, MOTOR, on_grid
from codriver.report.document import BLACK, Chart, Curve, Plot, Table
from codriver.signals import Grid, Log
from codriver.signals.signal import Array
from codriver.simulate.rig import RigCar, RigDrive, RigSetting
from codriver.simulate.rig_files import write_rig
from codriver.simulate.steering import Wheel
from codriver.vehicles import Vehicle

WHEEL = (0.0298, 0.3515)  # (90): true on the rig
SCALE, OFFSET = 1.8615, 0.2197  # (89)
PRINTED = {"joint EKF": (0.0298, 0.3515), "joint UKF": (0.0296, 0.3514)}
MAKERS = {"joint EKF": joint_ekf, "joint UKF": joint_ukf}
TICK = 0.02  # s; the paper resamples to it by the nearest neighbour
FRICTION = 0.15  # N m
SEED = 2


@dataclass(frozen=True, eq=False)
class Lab:
    """Recordings of the rig as read from its files, and what was found from weights and chirp.

    Attributes:
        weights: (89) from them.
        chirp, log: recordings of the chirp and of the drive, with command and angle.
        drive: what was true on the drive.
        passes: Algorithm 1 by each joint filter on the chirp, as the paper runs it.
        fit: the default identification on the same recording.
    """

    weights: TorqueScale
    chirp: Log
    log: Log
    drive: RigDrive
    passes: Mapping[str, Passes] = field(repr=False)
    fit: SteeringFit = field(repr=False)

    @property
    def wheel(self) -> Vehicle:
        """The wheel as the default identification has it, with its torque scale."""
        return self.fit.vehicle(self.weights.vehicle())

    def torque(self, log: Log) -> tuple[Array, Array]:
        """The motor's torque by (89): time and N m."""
        command = log["steering_motor_command"]
        return command.time, self.weights.scale * command.values + self.weights.offset


def visit_lab(friction: float = FRICTION, seconds: float = 180.0) -> Lab:
    """Weigh, chirp, drive; identify.

    Args:
        friction: of the wheel, N m.
        seconds: of the drive.
    """
    setting = RigSetting(Wheel(*WHEEL, friction), seconds=seconds)
    with TemporaryDirectory() as folder:
        files, drive = write_rig(Path(folder) / "rig", setting, SEED)
        command, mass, _ = read_weighings(files.weights)
        weights = identify_torque_scale(command, mass, source="weighings of the rig")
        chirp, log = (read(path, names=files.names) for path in (files.chirp, files.drive))
        chirp, log = (Log.of(list(made.values()), source=made.source) for made in (chirp, log))
    time, torque = (
        chirp["steering_motor_command"].time,
        weights.scale * chirp["steering_motor_command"].values + weights.offset,
    )
    grid = _nearest(chirp, time, torque)
    settings = JointSettings((J_S, B_S), dt=TICK)
    passes = {way: algorithm_1(grid, settings, make) for way, make in MAKERS.items()}
    return Lab(weights, chirp, log, drive, passes, identify_steering_wheel(chirp, weights.vehicle(), filters=False))


def _nearest(log: Log, time: Array, torque: Array) -> Grid:
    """Angle and torque on ticks of 20 ms by the nearest neighbour."""
    angle = log[ANGLE]
    ticks = np.arange(0.0, angle.time[-1], TICK)
    columns = {}
    for name, (t, x) in {ANGLE: (angle.time, angle.values), MOTOR: (time, torque)}.items():
        after = np.clip(np.searchsorted(t, ticks), 1, t.size - 1)
        nearest = np.where(ticks - t[after - 1] <= t[after] - ticks, after - 1, after)
        columns[name] = x[nearest]
    return on_grid(ticks, columns)


def simulator_chapter(lab: Lab, smooth: Lab) -> Chapter:
    """Eq. (89) to (92), figures 5 and 6.

    Args:
        lab: with friction in the wheel.
        smooth: without, as the paper's model has it.
    """
    items = (*_weights(lab), *_chirp(lab, smooth), *_sign())
    words = (
        "No recording of the paper's simulator is public. A simulated rig stands in: the wheel of (90) is the true one here, so "
        "these figures say whether the method finds a wheel, not which wheel the authors had. Every step goes through the files "
        "that a simulator would write, in degrees and in the motor's own unit.",
    )
    return Chapter(
        "The lab: torque scale, chirp, and the sign of the alignment torque (4.2, figures 5 and 6)", words,
        (_weights_chart(lab), _table(lab, smooth), *(_figure(way, smooth) for way in MAKERS)), items,
    )  # fmt: skip


def _weights(lab: Lab) -> tuple[Item, ...]:
    w = lab.weights
    return (
        near("(89): torque per command", SCALE, w.scale, "N m", 0.02, "12 simulated weighings with friction; standard error "
        f"{w.sd_scale:.4f}"),
        Item("(89): torque at command 0", OFFSET, w.offset, "N m", abs(w.offset - OFFSET) <= 3 * w.sd_offset,
             f"standard error {w.sd_offset:.4f}; three of them count"),
    )  # fmt: skip


def _chirp(lab: Lab, smooth: Lab) -> tuple[Item, ...]:
    items = []
    for way in MAKERS:
        for i, (letter, unit) in enumerate((("J_s", "kg m²"), ("b_s", "N m s/rad"))):
            found, rubbed = smooth.passes[way].values[i], lab.passes[way].values[i]
            items.append(Item(
                f"({90 + list(MAKERS).index(way)}): {letter} by {way}, a wheel without friction", PRINTED[way][i], found, unit,
                abs(found / WHEEL[i] - 1) <= 0.05,
                f"{found / WHEEL[i] - 1:+.1%} from the true {WHEEL[i]}; within 5 % counts; Q_z of (85), Euler's steps of 20 ms. "
                f"With {FRICTION} N m of friction in the wheel: {rubbed:.4f}, {rubbed / WHEEL[i] - 1:+.1%}",
            ))  # fmt: skip
    off = max(abs(lab.passes[way].values[1] / WHEEL[1] - 1) for way in MAKERS)
    c = lab.fit.coefficients
    fit_off = max(abs(c[k].value / w - 1) for k, w in zip(("J_s", "b_s"), WHEEL, strict=True))
    friction = c["T_c"].value if "T_c" in c else 0.0
    return (
        *items,
        Item("4.2: J_s and b_s describe a gaming wheel", "no friction in (27)", f"b_s is {off:.0%} too large with friction of "
             f"{FRICTION} N m", "",
             off <= 0.05, "friction that the model leaves out goes into b_s; within 5 % counts. The paper does not look for "
             "friction"),
        Item("the default identification on the same recording, friction and all", None,
             f"J_s {c['J_s'].value:.4f}, b_s {c['b_s'].value:.4f}, T_c {friction:.3f} N m", "", fit_off <= 0.02,
             f"not in the paper; at most {fit_off:.2%} from the truth, 2 % counts"),
    )  # fmt: skip


def _sign() -> tuple[Item, ...]:
    car = RigCar()
    back, away = (float(np.linalg.eigvals(coupled(car, sign)).real.max()) for sign in (1.0, -1.0))
    return (
        Item("(92): K_aln = -K_p C_f n_t, which is negative", "negative", "positive turns the wheel back", "", away <= 0,
             "angle, sideslip and yaw rate positive to one side. A wheel let go of at 50 km/h, single track and column of the "
             f"rig: with a negative K_aln it runs away with {away:.2f} 1/s, with a positive one it comes back with {-back:.2f} "
             "1/s or quicker"),
    )  # fmt: skip


def coupled(car: RigCar, sign: float) -> Array:
    """The wheel, let go of, with the car behind it: A of (delta_s, omega_s, beta, r), T_aln by (92) with K_aln of this sign."""
    J, b = WHEEL
    A, B = car.matrices()
    stiff = sign * car.alignment / car.ratio / J
    made = np.zeros((4, 4))
    made[0, 1] = 1.0
    made[1] = -stiff / car.ratio, -b / J, stiff, stiff * car.front / car.speed
    made[2:, 0], made[2:, 2:] = B / car.ratio, A
    return made


def _weights_chart(lab: Lab) -> Chart:
    w = lab.weights
    ends = np.array([w.command.min(), w.command.max()])
    return Chart(
        "Weights hung on the wheel (89)", "command T_com", (Plot("torque m g r (N m)", (
            Curve(f"{w.scale:.4f} T_com {w.offset:+.4f}", ends, w.scale * ends + w.offset, "#C84C00"),
            Curve("weighings", w.command, w.torque, "#0072B2", "points", width=6),
        ), 260),), half=True,
    )  # fmt: skip


def _table(lab: Lab, smooth: Lab) -> Table:
    rows: list[tuple[str, ...]] = [("true", *_told(WHEEL), f"0 or {FRICTION}", "")]
    for words, where in (("no friction", smooth), (f"friction {FRICTION} N m", lab)):
        for way, passes in where.passes.items():
            last = passes.passes[-1]
            rows.append((f"{way}, {words}", *_told(passes.values), "not in the model", last.why_not or "converged"))
        c = where.fit.coefficients
        friction = f"{c['T_c'].value:.3f}" if "T_c" in c else "none found"
        rows.append((f"prediction errors, {words}", *_told((c["J_s"].value, c["b_s"].value)), friction, ""))
    rows += [(f"the paper, {way}", *_told(PRINTED[way]), "", "") for way in MAKERS]
    return Table(("way", "J_s, kg m²", "b_s, N m s/rad", "T_c, N m", "algorithm 1"), tuple(rows),
                 "Chirp of 2 N m, 0.3 to 4 Hz, 40 s; joint filters at 50 Hz from (0.0672, 0.3562) as in the paper.")  # fmt: skip


def _told(values: tuple[float, float]) -> tuple[str, str]:
    """J_s and b_s to the paper's digits."""
    return f"{values[0]:.4f}", f"{values[1]:.4f}"


def _figure(way: str, lab: Lab) -> Chart:
    last = lab.passes[way].passes[-1]
    time = np.arange(last.path.shape[0], dtype=np.float64) * TICK
    plots = []
    for i, label in enumerate(("J_s (kg m²)", "b_s (N m s/rad)")):
        value, sd = last.path[:, i], last.path_sd[:, i]
        plots.append(Plot(label, (
            Curve(f"{label[:3]}, 1σ", time, value, "#0072B2", low=value - sd, high=value + sd),
            Curve("truth", time, np.full(time.size, WHEEL[i]), BLACK, dash="dot", width=1.2),
        ), 170, limits=(0.0, 3 * WHEEL[i])))  # fmt: skip
    number = 5 + list(MAKERS).index(way)
    return Chart(f"Figure {number}: {way} on the chirp, no friction", "time (s)", tuple(plots), half=True)
