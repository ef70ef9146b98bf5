"""Figures of steering-identification.md: python docs/measure/steering.py [RUNS]."""

# ruff: noqa: T201
from __future__ import annotations

import sys
from dataclasses import replace
from time import perf_counter

import numpy as np

import codriver as cd
from codriver.identify import identify_steering_wheel
from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_fit import fit_wheel
from codriver.identify.steering_joint import JointSettings
from codriver.identify.steering_likelihood import Rows
from codriver.identify.steering_ukf import joint_ukf
from codriver.simulate.steering import READINGS, Wheel, WheelNoise, WheelRuns, WheelSetting, chirp, simulate_wheel

TRUTH = np.array([0.0672, 0.3562])
HALF = (0.0336, 0.1781)


def by_filter(observer: cd.Observer, runs: WheelRuns) -> np.ndarray:
    """J_s and b_s at the end of each run."""
    program = cd.compile(observer)
    there = np.ones(runs.time.size, bool)
    last = []
    for measured in runs.measured:
        grid = cd.Grid(runs.time, 0.01, {"steering_wheel_angle": measured, "steering_motor_torque": runs.torque},
                       {"steering_wheel_angle": there}, {"steering_motor_torque": there})  # fmt: skip
        out = program.run_grid(grid)
        last.append([out["steering_inertia"][-1], out["steering_damping"][-1]])
    return np.array(last)


def by_fit(runs: WheelRuns) -> np.ndarray:
    """The same by prediction errors, from half of the truth."""
    n = runs.time.size
    yes, no = np.ones(n, bool), np.zeros(n, bool)
    return np.exp(
        [fit_wheel(Rows(0.01, runs.time, runs.torque, y, yes, no, "euler"), HALF).theta[:2] for y in runs.measured]
    )


def row(name: str, found: np.ndarray) -> None:
    """Bias and RMS error of the runs that are not lost, and how many are."""
    error = found / TRUTH - 1
    good = (np.abs(error) < 0.5).all(axis=1)
    bias, rms = 100 * error[good].mean(axis=0), 100 * np.sqrt((error[good] ** 2).mean(axis=0))
    print(f"| {name} | {bias[0]:.2f}, {bias[1]:.2f} | {rms[0]:.2f}, {rms[1]:.2f} | {(~good).sum()} |")


def main(count: int) -> None:
    """All tables."""
    print("| noise, way | bias J_s, b_s, % | RMS, % | lost |\n| --- | --- | --- | --- |")
    for reading in READINGS:
        runs = simulate_wheel(setting=WheelSetting(noise=WheelNoise(reading)), runs=count)
        row(f"{reading}, joint EKF", by_filter(joint_ekf(JointSettings(HALF)), runs))
        row(f"{reading}, joint UKF", by_filter(joint_ukf(JointSettings(HALF)), runs))
        if reading == "continuous":
            matched = JointSettings(HALF, process=(1e-4, 1e-4, 5e-8, 5e-8))
            row("the same, Q matched, EKF", by_filter(joint_ekf(matched), runs))
            row("the same, Q matched, UKF", by_filter(joint_ukf(matched), runs))
            row("the same, Q matched, EKF, bounds", by_filter(joint_ekf(replace(matched, keep="bounds")), runs))
            row("the same, Q matched, EKF, log", by_filter(joint_ekf(replace(matched, keep="log")), runs))
        row(f"{reading}, prediction errors", by_fit(runs))
    print("\n| recording | J_s, b_s, T_c found / true | standard errors, % | said |\n| --- | --- | --- | --- |")
    time = np.arange(3001) * 0.01
    torque = chirp(time, low=0.3, high=4.0)
    real = WheelSetting(Wheel(friction=0.5), WheelNoise(resolution=np.pi / 1800), "exact", (0.0, 0.0))
    stop = replace(real, wheel=Wheel(friction=0.5, end_stop=1.0))
    log = simulate_wheel(torque, real).log()
    motor, angle = log["steering_motor_torque"], log["steering_wheel_angle"]
    jumps = angle.values + 0.3 * (time > 10) - 0.05 * (time > 20) + (time == 5.0)
    late = log.with_signals(cd.Signal(motor.name, motor.time - 0.05, motor.values, "N*m"))
    jumped = log.with_signals(cd.Signal(angle.name, time, jumps, "rad"))
    stopped = simulate_wheel(3 * torque, stop).log()
    hands = np.convolve(np.random.default_rng(1).standard_normal(3001), np.ones(60) / 60, "same") * 8
    held = simulate_wheel(torque + hands, real).log().with_signals(motor)
    for name, one in {
        "chirp": log,
        "torque 50 ms late": late,
        "encoder jumps": jumped,
        "end stops": stopped,
        "hands on": held,
    }.items():
        begun = perf_counter()
        fit = identify_steering_wheel(one, filters=False)
        took = perf_counter() - begun
        found = [fit.coefficients.get(k) for k in ("J_s", "b_s", "T_c")]
        ratio = ", ".join("-" if c is None else f"{c.value / t:.3f}" for c, t in zip(found, (*TRUTH, 0.5), strict=True))
        sd = ", ".join("-" if c is None else f"{100 * c.sd / t:.2f}" for c, t in zip(found, (*TRUTH, 0.5), strict=True))
        print(f"| {name} | {ratio} | {sd} | {took:.1f} s; {fit.findings[0].text} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
