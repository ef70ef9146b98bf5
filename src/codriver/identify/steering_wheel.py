"""Identify a steering wheel from a recording in which its motor alone turns it (2019, Algorithm 1, and a better way).

    J_s omega' + b_s omega + T_c sign(omega) = T(t - delay) + T_0

The default is the fit over the whole record (`steering_fit`), with friction, a constant torque, delay and end stops as the
recording asks for them (`steering_model`).

A coefficient is refused where its standard error says that the recording does not tell it. Both halves are fitted on their own,
too, and must agree. The joint EKF and UKF of the paper run beside it, by Algorithm 1 (`steering_passes`), for comparison.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi

import numpy as np

from codriver.errors import UsageError
from codriver.finding import Finding
from codriver.identify.brake_fit import Refusal
from codriver.identify.brake_rows import short_name
from codriver.identify.standard_errors import autocorrelation
from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_fit import Best, resume
from codriver.identify.steering_joint import JointSettings
from codriver.identify.steering_likelihood import Rows, simulate
from codriver.identify.steering_model import Asked, choose_model
from codriver.identify.steering_passes import Passes, algorithm_1
from codriver.identify.steering_record import Record, steering_record
from codriver.identify.steering_result import Excitation, SteeringFit, WheelCoefficient, coefficients_of
from codriver.identify.steering_ukf import joint_ukf
from codriver.observers.column import USUAL_WHEELS
from codriver.signals import Grid, Log
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

PRESETS = {"okamoto2019": "euler"}
REFUSED_SD = 0.2  # of J_s and b_s, as a share
FRICTION_SD = 0.1  # N m, and a quarter of T_c
AHEAD = 2.0  # s
GOOD_R2, LEAST_R2 = 0.8, 0.5  # of the angle so far ahead: below the second the torque is not what turns the wheel
LAGS = 0.5  # s
WHITE = 0.2  # greatest autocorrelation of innovations that goes without saying
HALVES = 4.0  # standard errors
LEAST_TICKS = 200  # that count, for halves to be looked at
TENTH = 0.1  # s


def identify_steering_wheel(
    log: Log, vehicle: Vehicle | None = None, *, preset: str | None = None, guess: tuple[float, float] | None = None,
    torques: Sequence[str] = (), friction: bool | None = None, constant: bool | None = None, delay: float | None = None,
    end_stop: float | None = None, rate: float | None = None, filters: bool = True,
) -> SteeringFit:  # fmt: skip
    """J_s, b_s and T_c of a steering wheel.

    Args:
        log: with steering_wheel_angle and the motor's torque (or command) or alignment torque; no hands on the wheel.
        vehicle: with torque_scale, where the log has a command only.
        preset: "okamoto2019" takes the paper's plant (77) and settings: Euler's step, no friction, no delay.
        guess: J_s and b_s to start from; found by least squares by default.
        torques: standard names whose sum turns the wheel; see `steering_record`.
        friction, constant: whether T_c and T_0 are in the model; None lets the recording decide.
        delay: by which the torque acts late, s; None finds it, in whole ticks up to 0.15 s.
        end_stop: angle beyond which nothing counts, rad; end stops that show themselves are left out anyway.
        rate: ticks per second; that of the quicker signal by default.
        filters: whether the joint EKF and UKF run, too.

    Raises:
        UsageError: there is no such preset, or numbers that cannot be.
        MissingSignal, VehicleError, LogError: see `steering_record`.
        LogError: no filter runs on it.
    """
    _check(preset, guess, delay, end_stop)
    if preset is not None:
        friction, constant, delay = friction or False, constant or False, delay or 0.0
    record = steering_record(log, vehicle, torques=torques, rate=rate, form=PRESETS.get(preset or "", "exact"))
    rows = record.rows
    if end_stop is not None:
        rows = replace(rows, reset=rows.reset | (np.abs(rows.angle) >= end_stop))
    chosen = choose_model(rows, guess, Asked(friction, constant, delay))
    best, rows, late = chosen.best, chosen.rows, chosen.delay
    simulated, r2 = _ahead(rows, best)
    found, refused = _told(rows, best, r2, record.scale_error)
    rho, lags = _correlation(rows, best)
    fit = SteeringFit(
        found, refused, _excitation(rows, best), float(np.exp(best.theta[6] / 2)), best.run.nis, lags, rho, r2, late, chosen.stops,
        float(rows.reset.mean()), float(rows.time[-1] - rows.time[0]), (), (), best, rows, simulated, record.torque_from,
        short_name(log),
    )  # fmt: skip
    findings = _findings(fit, record, chosen.elsewhere)
    order = ("bad", "warn", "ok")
    passes = _filters(rows, guess or (float(np.exp(best.theta[0])), float(np.exp(best.theta[1])))) if filters else ()
    return replace(fit, findings=tuple(sorted(findings, key=lambda f: order.index(f.severity))), filters=passes)


def _check(preset: str | None, guess: tuple[float, float] | None, delay: float | None, end_stop: float | None) -> None:
    """Refuse what cannot be."""
    if preset is not None and preset not in PRESETS:
        raise UsageError(f"no preset is called '{preset}'", f"one of {', '.join(PRESETS)}", "choose one, or none")
    if guess is not None and not min(guess) > 0:
        raise UsageError(f"a guess of {guess[0]:g}, {guess[1]:g}", "positive J_s and b_s", "correct it")
    if delay is not None and not 0 <= delay <= 1:
        raise UsageError(f"a delay of {delay:g} s", "0 to 1 s", "correct it")
    if end_stop is not None and not end_stop > 0:
        raise UsageError(f"an end stop at {end_stop * 180 / pi:g} deg", "a positive angle", "correct it")


def _told(
    rows: Rows, best: Best, r2: float, scale_error: float
) -> tuple[dict[str, WheelCoefficient], tuple[Refusal, ...]]:
    """Coefficients that the recording tells, and refusals."""
    found, refused = coefficients_of(best, scale_error), []
    if not r2 > LEAST_R2:
        share = f"{max(np.nan_to_num(r2), 0.0):.0%} of the angle's changes within {AHEAD:g} s"
        why = f"the torque explains {share}; something else turns the wheel, or holds it"
        if np.isnan(r2):
            why = f"the recording has no {AHEAD:g} s without a break to judge it by"
        return {}, tuple(Refusal(letter, why) for letter in found if letter != "T_0")
    x = _excitation(rows, best)
    of = f"of {x.torque:.2g} N m (RMS)"
    because = {
        "J_s": f"the wheel hardly accelerates: J_s times acceleration is {x.inertia:.2g} N m {of}",
        "b_s": f"the wheel hardly turns, or friction takes its place: b_s times rate is {x.damping:.2g} N m {of}",
    }
    for letter, why in because.items():
        c = found[letter]
        if not c.sd <= REFUSED_SD * c.value:
            alone = (
                f"; only a combination of J_s and b_s is told (correlation {x.correlation:.3f})"
                if abs(x.correlation) > 0.98
                else ""
            )
            refused.append(Refusal(letter, f"{c.value:.3g} {c.unit} with a standard error of {c.sd:.2g}: {why}{alone}"))
    if "T_c" in found:
        c = found["T_c"]
        if c.value < 0:
            refused.append(Refusal("T_c", f"{c.value:.3g} N m is negative: the wheel shows no friction"))
        elif not c.sd <= FRICTION_SD + c.value / 4:
            refused.append(Refusal("T_c", f"{c.value:.3g} N m with a standard error of {c.sd:.2g}: no slow reversals"))
    return {letter: c for letter, c in found.items() if letter not in {r.name for r in refused}}, tuple(refused)


def _excitation(rows: Rows, best: Best) -> Excitation:
    """What the recording excites, with the wheel found."""
    use = best.run.counts
    J, b = float(np.exp(best.theta[0])), float(np.exp(best.theta[1]))
    friction, rate = float(best.theta[2]), best.run.rate
    torque = rows.torque + best.theta[3]
    against = b * rate + friction * np.sign(rate)
    noise = np.exp(best.theta[5]) * max(round(TENTH / rows.dt), 1)
    C = best.covariance[:2, :2]
    size = float(np.sqrt(C[0, 0] * C[1, 1]))
    sign = np.sign(rate[use])
    return Excitation(
        _rms(rows.torque[use]), _rms((torque - against)[use]), _rms(b * rate[use]), abs(friction),
        float(J * np.sqrt(noise) / TENTH),
        _rms(rate[use]), float(C[0, 1] / size) if size > 0 else 1.0, int((sign[1:] * sign[:-1] < 0).sum()),
    )  # fmt: skip


def _ahead(rows: Rows, best: Best) -> tuple[Array, float]:
    """The angle from the torque alone, restarted every two seconds from the filter; and its R2."""
    every = max(round(AHEAD / rows.dt), 2)
    simulated = np.full(rows.time.size, np.nan)
    wrong = change = 0.0
    for start in range(max(round(0.5 / rows.dt), 1), rows.time.size - every + 1, every):
        if rows.reset[start : start + every].any():
            continue
        state = float(best.run.angle[start]), float(best.run.rate[start])
        part = simulate(rows, best.theta, start, state, every)
        simulated[start : start + every] = part
        there = rows.fresh[start : start + every]
        truth = rows.angle[start : start + every][there]
        wrong += float(np.sum((truth - part[there]) ** 2))
        change += float(np.sum((truth - state[0]) ** 2))
    return simulated, 1.0 - wrong / change if change > 0 else float("nan")


def _correlation(rows: Rows, best: Best) -> tuple[Array, Array]:
    """Autocorrelation of the normalised innovations, and its lags in s."""
    e = np.where(best.run.counts, best.run.e / np.sqrt(best.run.s), 0.0)
    rho = autocorrelation(e, best.run.counts, np.array([0, e.size]), max(round(LAGS / rows.dt), 1))
    return rho, np.arange(rho.size, dtype=np.float64) * rows.dt


def _findings(fit: SteeringFit, record: Record, elsewhere: int) -> list[Finding]:
    """What is to say."""
    x, said = fit.excitation, list(record.findings)
    said += [Finding("bad", f"refused: {names}: {why}") for names, why in fit.refused_together()]
    if not fit.best.converged:
        said.append(Finding("bad", "the search did not come to rest: the figures are where it stopped"))
    for stop in fit.end_stops:
        said.append(
            Finding(
                "warn",
                f"the wheel is stopped at {stop * 180 / pi:.1f} deg (end stop, or a saturated angle); left out there",
            )
        )
    if elsewhere:
        said.append(
            Finding("warn", f"{elsewhere} moments fit no motion of the wheel (encoder jumps, knocks); left out")
        )
    if fit.r2 <= GOOD_R2:
        said.append(Finding(
            "bad" if fit.r2 <= LEAST_R2 else "warn",
            f"the torque explains {max(fit.r2, 0):.0%} of the angle's changes within {AHEAD:g} s: hands on the wheel, a centring "
            "spring, a wrong sign or unit of the torque?",
        ))  # fmt: skip
    if x.unexplained > 0.3 * x.torque:
        said.append(
            Finding(
                "warn",
                f"a torque of {x.unexplained:.2g} N m (RMS over {TENTH:g} s) turns the wheel beside the motor's {x.torque:.2g}",
            )
        )
    worst = float(np.abs(fit.correlation[1:]).max())
    if worst > WHITE:
        said.append(
            Finding(
                "warn", f"innovations are alike from tick to tick (up to {worst:.2f}): the model leaves something out"
            )
        )
    if fit.delay > 0:
        said.append(
            Finding("warn", f"the torque acts {fit.delay * 1000:.0f} ms late; J_s is that of a wheel with this delay")
        )
    for letter, low, high, unit in USUAL_WHEELS:
        if letter in fit.coefficients and not low <= (value := fit.coefficients[letter].value) <= high:
            said.append(
                Finding(
                    "warn",
                    f"{letter} = {value:.3g} {unit} is unusual (cars and simulators have {low:g} to {high:g}): are the units of "
                    "angle and torque right?",
                )
            )
    said += _halves(fit)
    for letter, c in fit.coefficients.items():
        if letter != "T_0" and not 0.4 < c.sd_robust / max(c.sd_model, 1e-300) < 2.5:
            said.append(
                Finding(
                    "warn",
                    f"{letter}: the two standard errors differ, {c.sd_model:.2g} and {c.sd_robust:.2g} {c.unit}; the larger counts",
                )
            )
    if not said or all(f.severity == "ok" for f in said):
        said.append(
            Finding(
                "ok",
                f"the torque explains {fit.r2:.1%} of the angle's changes within {AHEAD:g} s; innovations are white",
            )
        )
    return said


def _halves(fit: SteeringFit) -> list[Finding]:
    """Whether each half of the recording tells the same."""
    r, ends = fit.rows, []
    counted = np.flatnonzero(fit.best.run.counts)
    if counted.size < LEAST_TICKS:
        return []
    middle = int(counted[counted.size // 2])
    for part in (slice(0, middle), slice(middle, None)):
        half = replace(
            r, time=r.time[part], torque=r.torque[part], angle=r.angle[part], fresh=r.fresh[part], reset=r.reset[part]
        )
        ends.append(resume(half, fit.best))
    said = []
    for letter, name, i in (("J_s", "ln_J", 0), ("b_s", "ln_b", 1)):
        off = abs(ends[0].theta[i] - ends[1].theta[i])
        sd = float(np.hypot(ends[0].sd(name), ends[1].sd(name)))
        if letter in fit.coefficients and off > max(HALVES * sd, 0.02):
            first, second = (float(np.exp(end.theta[i])) for end in ends)
            said.append(
                Finding("warn", f"{letter} differs between the halves of the recording: {first:.4g} and {second:.4g}")
            )
    return said


def _filters(rows: Rows, guess: tuple[float, float]) -> tuple[Passes, ...]:
    """The joint filters with the paper's noise, where the recording has no holes that they do not know of."""
    there = np.ones(rows.time.size, bool)
    grid = Grid(
        rows.time, rows.dt, {"steering_wheel_angle": rows.angle, "steering_motor_torque": rows.torque},
        {"steering_wheel_angle": rows.fresh}, {"steering_motor_torque": there},
    )  # fmt: skip
    settings = JointSettings(guess, dt=rows.dt, start=(float(rows.angle[rows.fresh][0]), 0.0))
    return tuple(algorithm_1(grid, settings, make) for make in (joint_ekf, joint_ukf))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x))) if x.size else 0.0
