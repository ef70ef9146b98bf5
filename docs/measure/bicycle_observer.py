"""Figures of "Bicycles, and real rides" in motorcycle.md: python docs/measure/bicycle_observer.py. Needs ../shared/data.

Roll from 5 s on, in degrees; torque from 5 s on, N m, and R2 where the estimate may come 0, 20, 40 ms later.
"""

# ruff: noqa: T201
from __future__ import annotations

from math import cos

import numpy as np
from bicycle import DATA, NAMES, RUNS, delft

import codriver as cd
from codriver.models import BicycleParameters
from codriver.observers import build
from codriver.observers.bicycle_kalman import bicycle_kalman
from codriver.observers.motorcycle_imu import motorcycle_imu

SKIP = 5.0  # s
SHIFTS = (0.0, 0.02, 0.04)  # s
DEGREE = np.pi / 180
FRICTION = 0.384  # N m, of the other bicycle: pasma2024


def rms(x: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(x**2)))


def yaw_of_steer(log: cd.Log, p: BicycleParameters) -> cd.Signal:
    """A yaw rate that a riderless bicycle's log lacks, by its wheels; the encoder's mean taken out."""
    angle = log["steer_angle"]
    v = np.interp(angle.time, log["longitudinal_speed"].time, log["longitudinal_speed"].values)
    steer = angle.values - angle.values.mean()
    rate = (v * steer + p.c * np.gradient(steer, angle.time)) * cos(p.lam) / p.w
    return cd.Signal("yaw_rate", angle.time, rate, "rad/s")


def yaw_of_heading(log: cd.Log) -> cd.Signal:
    """The Davis bicycle's yaw rate from its yaw angle, whose axis points down."""
    table = np.genfromtxt(
        DATA / "davis-instrumented-bicycle" / "run-283-first-60s.csv", delimiter=",", skip_header=1, usecols=(8, 9)
    )
    return cd.Signal("yaw_rate", table[:, 1], -np.gradient(table[:, 0], table[:, 1]), "rad/s")


def roll_line(name: str, found: np.ndarray, truth: np.ndarray, sd: np.ndarray | None, k: int) -> None:
    """Error of a roll, about its mean, and coverage."""
    e = (found[: truth.size] - truth)[k:]
    told = "" if sd is None else f", in band {np.mean(np.abs(e) < 1.96 * sd[: truth.size][k:]):.3f}"
    print(f"    roll {name:34s} {rms(e) / DEGREE:.2f}, about its mean {e.std() / DEGREE:.2f}{told}")


def torque_line(name: str, found: np.ndarray, sd: np.ndarray, truth: np.ndarray, dt: float, k: int) -> None:
    """Error of a torque, R2 with delays, and coverage."""
    n = truth.size
    e = (found[:n] - truth)[k:]
    r2 = []
    for shift in SHIFTS:
        late = round(shift / dt)
        a, b = found[k + late : n], truth[k : n - late]
        r2.append(f"{1 - np.mean((a - b) ** 2) / b.var():.2f}")
    inside = np.mean(np.abs(e) < 1.96 * sd[:n][k:])
    print(f"    torque {name:32s} {rms(e):.2f}, {', '.join(r2)}, in band {inside:.3f}")


def judge(run: str, log: cd.Log, vehicle: str, dt: float, yaw: cd.Signal, friction: float | None) -> None:
    """All ways on one run."""
    print(run)
    given = log.without("roll_angle").without("rider_torque")
    truth = log.sample(("roll_angle", "rider_torque", "roll_rate"), dt).values
    k = round(SKIP / dt)
    roll, torque = truth["roll_angle"], truth["rider_torque"]
    whole = np.cumsum(truth["roll_rate"]) * dt
    roll_line("zero", np.zeros_like(roll), roll, None, k)
    roll_line("gyroscope added up", whole, roll, None, k)
    rate = truth["roll_rate"] - truth["roll_rate"][:k].mean()
    roll_line("the same, mean of 5 s taken out", np.cumsum(rate) * dt, roll, None, k)
    imu = cd.compile(motorcycle_imu(dt)).run(given.with_signals(yaw))
    roll_line("motorcycle-imu", imu.columns["roll_angle"], roll, imu.columns["roll_angle_sd"], k)
    ways = {"bicycle-kalman": (build("bicycle-kalman", vehicle, dt=dt), given)}
    if friction is not None:
        ways["with yaw rate"] = (ways["bicycle-kalman"][0], given.with_signals(yaw))
        p = BicycleParameters.from_vehicle(cd.load_vehicle(vehicle))
        ways["and friction"] = (bicycle_kalman(p, dt, friction=friction), given.with_signals(yaw))
        ways["the benchmark bicycle instead"] = (
            build("bicycle-kalman", "meijaard2007", dt=dt),
            given.with_signals(yaw),
        )
    print(f"    torque zero {rms(torque[k:]):.2f}")
    for name, (observer, fed) in ways.items():
        found = cd.compile(observer).run(fed).columns
        roll_line(name, found["roll_angle"], roll, found["roll_angle_sd"], k)
        torque_line(name, found["rider_torque"], found["rider_torque_sd"], torque, dt, k)
        print(
            f"      zero of the encoder {found['steer_offset'][-1]:.4f}, gyroscope's bias {found['roll_rate_bias'][-1]:.4f}"
        )


def main() -> None:
    """Print all."""
    own = BicycleParameters.from_vehicle(cd.load_vehicle("pasma2024"))
    for run, log in delft().items():
        judge(f"Delft {run} ({RUNS[run]})", log, "pasma2024", 0.01, yaw_of_steer(log, own), None)
    log = cd.read(
        DATA / "davis-instrumented-bicycle" / "run-283-first-60s.csv",
        names=NAMES / "davis-bicycle.toml",
    )
    judge("Davis", log, "moore2012", 0.005, yaw_of_heading(log), FRICTION)


if __name__ == "__main__":
    main()
