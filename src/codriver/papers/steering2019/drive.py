"""2019 section 4.2, the drive: what was recorded (figure 8), the torque (figure 9), the angle reproduced from it (figure 10).

    P(s) = 1 / (s (J_s s + b_s)),   T^ = G(s) T_dr,   delta_s - delta^ = P (1 - G) T_dr  ->  tau / b_s T_dr   for slow torques

G passes T_dr with a delay tau. So the reproduced angle is off by what the wheel turns in tau under the torque, whatever J_s and
b_s; and the angle from which T^ was made comes back from it whatever the wheel. Figure 10 measures lag.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from codriver.estimate import Estimate
from codriver.models.steering import tick_of
from codriver.observers.pi_weights import PI_WEIGHTS, wheel_pi_design
from codriver.offline import smooth
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.papers.steering2019.runs import ALIGNMENT, ANGLE, DEGREE, valid_rmse
from codriver.papers.steering2019.simulator import TICK, WHEEL, Lab
from codriver.papers.steering2019.torque import transfer
from codriver.report.document import BLACK, Chart, Curve, Plot, Table
from codriver.run import estimate_log
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

PRESET = "okamoto2019-simulator"
PRINTED = {"joint EKF": 24.93, "joint UKF": 24.90}  # deg
SHOWN = (40.0, 80.0)  # s
COLORS = ("#0072B2", "#8E2F86", "#E69F00", "#007A5A", "#C84C00")


@dataclass(frozen=True, eq=False)
class Told:
    """An estimate of the drive's torque.

    Attributes:
        estimate: itself.
        truth: T_dr on its ticks, N m.
        angle: reproduced from its torque alone, rad, from the first angle and at rest.
        rmse: of the torque, N m; angle_rmse of the angle over the whole record, deg.
    """

    estimate: Estimate
    truth: Array
    angle: Array
    rmse: float
    angle_rmse: float


def told(estimate: Estimate, wheel: Vehicle, lab: Lab) -> Told:
    """An estimate held against the truth and against the measured angle."""
    time, dt = estimate.time, estimate.grid.dt
    truth = np.interp(time, lab.drive.time, lab.drive.driver_torque)
    tick = tick_of(wheel.number("steering_inertia"), wheel.number("steering_damping"), dt)
    known = np.interp(time, *lab.torque(lab.log))
    if "column_torque" in estimate.columns:
        known = estimate.columns["column_torque"]
    total = estimate.columns["driver_torque"] + known
    held = np.r_[0.0, 0.5 * (total[1:] + total[:-1])]
    rate = lfilter([tick.push], [1.0, -tick.keep], held)
    before = np.r_[0.0, rate[:-1]]
    measured = estimate.grid.values[ANGLE]
    angle = measured[0] + np.cumsum(tick.reach * before + tick.lift * held)
    return Told(
        estimate, truth, angle, valid_rmse(estimate, truth), float(np.sqrt(np.mean((angle - measured) ** 2))) / DEGREE
    )


def drive_chapter(lab: Lab) -> Chapter:
    """Figures 8 to 10."""
    time, torque = lab.torque(lab.log)
    log = lab.log.with_signals(Signal(ALIGNMENT, time, torque, "N*m", "motor's command by (89)"))
    wheels = {way: _wheel(*lab.passes[way].values) for way in PRINTED}
    wrong = {f"J_s, b_s {factor - 1:+.0%}": _wheel(factor * WHEEL[0], factor * WHEEL[1]) for factor in (0.7, 1.3)}
    found = {f"PI observer, {way}": _pi(log, wheel, lab) for way, wheel in wheels.items()}
    found["PI observer, true J_s, b_s"] = _pi(log, _wheel(*WHEEL), lab)
    found |= {f"PI observer, {words}": _pi(log, wheel, lab) for words, wheel in wrong.items()}
    own = lab.wheel
    name = "driver-torque-logged"
    found["Kalman filter, identified wheel"] = told(estimate_log(name, log, own), own, lab)
    found["its smoother"] = told(smooth(log, name, own), own, lab)
    for words, wheel in wrong.items():
        found[f"smoother, {words}"] = told(smooth(log, name, wheel), wheel, lab)
    charts = (_figure_8(lab), _figure_9(found), _figure_10(found), _table(found))
    lead = (
        "A simulated driver steers round a circuit at 50 km/h, by a wheel with friction; its log has the angle and the motor's "
        "command. The estimators get J_s and b_s from the chirp and the alignment torque from (89). Beside them stands what the "
        "paper did not have: the true torque. Figure 7, photographs of the simulator, has no counterpart.",
    )
    return Chapter("The drive (4.2, figures 8 to 10)", lead, charts, _items(found, wheels))


def _wheel(inertia: float, damping: float) -> Vehicle:
    return (
        Vehicle("wheel", "", "", {})
        .with_parameter("steering_inertia", inertia)
        .with_parameter("steering_damping", damping)
    )


def _pi(log: Log, wheel: Vehicle, lab: Lab) -> Told:
    return told(estimate_log("driver-torque-pi", log, wheel, preset=PRESET, rate=1 / TICK), wheel, lab)


def _items(found: dict[str, Told], wheels: dict[str, Vehicle]) -> tuple[Item, ...]:
    items = []
    for way, printed in PRINTED.items():
        t = found[f"PI observer, {way}"]
        items.append(Item(
            f"fig. 10: RMSE of the reproduced angle, {way}", printed, t.angle_rmse, "deg", None,
            "another driver and road, so the number itself cannot agree. The measured angle has "
            f"{np.std(t.estimate.grid.values[ANGLE]) / DEGREE:.0f} deg RMS",
        ))  # fmt: skip
    ekf, ukf = (found[f"PI observer, {way}"] for way in PRINTED)
    share, lag = _lag(ekf, wheels["joint EKF"])
    smoothed = found["its smoother"]
    wrong = {name: t for name, t in found.items() if "%" in name and name.startswith("smoother")}
    pi_wrong = [t.angle_rmse for name, t in found.items() if "%" in name and name.startswith("PI")]
    best = found["Kalman filter, identified wheel"]
    return (
        *items,
        Item("fig. 10: the reproduced angle verifies the estimate", "a check",
             f"{share:.0%} of its error is lag", "", share < 0.5,
             f"share of the error explained by tau / b_s T^, with tau = {1000 * lag:.0f} ms, the delay of the PI observer for "
             "slow torques; tau times the torque's RMS over b_s is what the wheel turns meanwhile. From the smoother's torque "
             f"the angle comes back to {smoothed.angle_rmse:.2g} deg"),
        Item("4.2: a smaller RMSE of the angle means better parameters (UKF over EKF)", "slightly better performance",
             f"J_s and b_s 30 % wrong: {min(pi_wrong):.1f} to {max(pi_wrong):.1f} deg by PI, "
             f"{min(t.angle_rmse for t in wrong.values()):.2g} to {max(t.angle_rmse for t in wrong.values()):.2g} by "
             "smoother", "",
             min(pi_wrong) > 1.02 * found["PI observer, true J_s, b_s"].angle_rmse,
             f"with the true ones {found['PI observer, true J_s, b_s'].angle_rmse:.1f} deg by PI. The torque was made from this "
             "angle with the same J_s and b_s, so the angle comes back whatever they are: the criterion cannot tell a wrong "
             f"wheel. The torque of the wrong ones is {min(t.rmse for t in wrong.values()):.3f} to "
             f"{max(t.rmse for t in wrong.values()):.3f} N m off"),
        Item("fig. 9: EKF's and UKF's parameters give nearly the same torque", "difficult to discern",
             f"{_apart(ekf, ukf):.3f} N m RMS apart", "", _apart(ekf, ukf) < 0.1 * ekf.rmse,
             f"against errors of {ekf.rmse:.3f} and {ukf.rmse:.3f} N m; a tenth counts as the same"),
        Item("fig. 9: the torque against the truth, which the paper did not have", None,
             f"PI {ekf.rmse:.3f}, Kalman filter {best.rmse:.3f}, smoother {smoothed.rmse:.3f} N m", "",
             best.rmse < ekf.rmse,
             f"RMSE; T_dr has {np.std(ekf.truth):.2f} N m RMS. The Kalman filter knows the wheel's friction and fits its noise to "
             "the drive. The PI observer is late, and takes the friction for the driver's doing"),
    )  # fmt: skip


def _apart(a: Told, b: Told) -> float:
    return float(np.sqrt(np.mean((a.estimate.columns["driver_torque"] - b.estimate.columns["driver_torque"]) ** 2)))


def _lag(t: Told, wheel: Vehicle) -> tuple[float, float]:
    """Share of the reproduced angle's error that tau / b_s T^ explains, about their means; and tau, s."""
    J, b = wheel.number("steering_inertia"), wheel.number("steering_damping")
    design = wheel_pi_design(J, b, PI_WEIGHTS[PRESET])
    slow = 0.01  # rad/s
    tau = float(-np.angle(transfer(design, slow)) / slow)
    error = t.estimate.grid.values[ANGLE] - t.angle
    model = tau / b * t.estimate.columns["driver_torque"]
    left = (error - error.mean()) - (model - model.mean())
    return float(1 - np.var(left) / np.var(error)), tau


def _part(t: Told) -> slice:
    return slice(*np.searchsorted(t.estimate.time, SHOWN).tolist())


def _figure_8(lab: Lab) -> Chart:
    d = lab.drive
    step = slice(None, None, 5)
    time, torque = lab.torque(lab.log)
    return Chart(
        "Figure 8: what the simulator recorded", "time (s)",
        (
            Plot("wheel (deg)", (Curve("angle", d.time[step], d.measured[step] / DEGREE, "#1a1a1a"),), 140, (0.0,)),
            Plot("T_aln (N m)", (Curve("by (89) from the command", time[step], torque[step], "#C84C00"),), 130, (0.0,)),
            Plot("yaw rate (deg/s)", (Curve("yaw rate", d.time[step], d.yaw_rate[step] / DEGREE, "#0072B2"),), 120, (0.0,)),
            Plot("curvature (1/m)", (Curve("of the road", d.time[step], d.curvature[step], "#757575"),), 110, (0.0,)),
        ),
    )  # fmt: skip


def _figure_9(found: dict[str, Told]) -> Chart:
    curves = []
    for name, color in zip(
        ("PI observer, joint EKF", "PI observer, joint UKF", "Kalman filter, identified wheel"), COLORS, strict=False
    ):
        t = found[name]
        p = _part(t)
        curves.append(Curve(name, t.estimate.time[p], t.estimate.columns["driver_torque"][p], color))
    t = found["its smoother"]
    p = _part(t)
    truth = Curve("true T_dr", t.estimate.time[p], t.truth[p], BLACK, dash="dot", width=1.2)
    return Chart(
        "Figure 9: the estimated torque, 40 s of the drive", "time (s)", (Plot("torque (N m)", (*curves, truth), 280, (0.0,)),),
        "The curves by EKF's and UKF's parameters lie on one another. The paper's figure has no truth.",
    )  # fmt: skip


def _figure_10(found: dict[str, Told]) -> Chart:
    curves = []
    for name, color in zip(
        ("PI observer, joint EKF", "PI observer, joint UKF", "Kalman filter, identified wheel", "its smoother"),
        COLORS,
        strict=False,
    ):
        t = found[name]
        step = slice(None, None, max(round(0.1 / t.estimate.grid.dt), 1))
        curves.append(
            Curve(
                f"from the {name}" if name.startswith("PI") else name,
                t.estimate.time[step],
                t.angle[step] / DEGREE,
                color,
            )
        )
    t = found["its smoother"]
    step = slice(None, None, max(round(0.1 / t.estimate.grid.dt), 1))
    measured = Curve(
        "measured", t.estimate.time[step], t.estimate.grid.values[ANGLE][step] / DEGREE, BLACK, dash="dot", width=1.2
    )
    return Chart(
        "Figure 10: the angle from the estimated torque alone", "time (s)",
        (Plot("angle (deg)", (*curves, measured), 280, (0.0,)),),
        "The wheel (28) turned by the estimate and the alignment torque from the first angle on, never corrected. EKF and UKF "
        "lie on one another, and so do smoother and measurement.",
    )  # fmt: skip


def _table(found: dict[str, Told]) -> Table:
    rows: list[tuple[str | float | None, ...]] = [
        (name, t.rmse, float(np.mean((t.estimate.columns["driver_torque"] - t.truth)[t.estimate.valid])), t.angle_rmse)
        for name, t in found.items()
    ]
    rows += [(f"the paper, {way}", None, None, printed) for way, printed in PRINTED.items()]
    return Table(
        ("estimate", "RMSE of the torque, N m", "mean error, N m", "RMSE of the reproduced angle, deg"), tuple(rows)
    )
