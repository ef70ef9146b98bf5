"""Algorithm 1 of the 2019 paper with its last lines made concrete: what has converged, and what comes next.

A pass of a joint filter over the recording has converged if
    1. all numbers are finite, and J_s and b_s were positive at every tick;
    2. neither changed over the last quarter by more than 5 %, or three of the standard deviations the filter claims;
    3. the filter claims a standard deviation of at most 20 % for both.

The next guess: where a pass ended positive but had not settled, it goes on from where it ended. Where it was lost (1), the guess
is the first one times the next entry of a ladder, and the start variances of J_s and b_s are halved each time, so that the filter
takes smaller steps and is less apt to pass 0. After all rungs it gives up and says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_joint import JointSettings
from codriver.observers.observer import Observer
from codriver.program import compile
from codriver.signals import Grid
from codriver.signals.signal import Array

SETTLED, SURE = 0.05, 0.2
LADDER = (
    (1.0, 1.0),
    (2.0, 2.0),
    (0.5, 0.5),
    (4.0, 2.0),
    (2.0, 0.5),
    (0.5, 2.0),
    (4.0, 4.0),
    (8.0, 2.0),
    (0.25, 0.5),
    (8.0, 8.0),
)
NAMES = ("steering_inertia", "steering_damping")


@dataclass(frozen=True, eq=False)
class Pass:
    """One pass over a recording.

    Attributes:
        guess: it started from, kg m^2 and N m s/rad.
        values: it ended with.
        sds: it claims.
        nis: mean squared normalised innovation; about 1 if the filter's noise is that of the recording.
        why_not: why it has not converged; empty if it has.
        path: J_s and b_s at every tick, shape (n, 2).
        path_sd: their standard deviations, shape (n, 2).
    """

    guess: tuple[float, float]
    values: tuple[float, float]
    sds: tuple[float, float]
    nis: float
    why_not: str
    path: Array = field(repr=False)
    path_sd: Array = field(repr=False)

    @property
    def lost(self) -> bool:
        """Whether it ended nowhere: not finite, or not positive on the way."""
        return not np.all(self.path > 0)


@dataclass(frozen=True, eq=False)
class Passes:
    """All passes of one filter; the last one is the answer if it converged.

    Attributes:
        name: of the filter.
        passes: in order.
    """

    name: str
    passes: tuple[Pass, ...]

    @property
    def converged(self) -> bool:
        """Whether the last pass did."""
        return not self.passes[-1].why_not

    @property
    def values(self) -> tuple[float, float]:
        """J_s and b_s of the last pass."""
        return self.passes[-1].values


def algorithm_1(grid: Grid, settings: JointSettings, make: Callable[[JointSettings], Observer] = joint_ekf) -> Passes:
    """Identify by passes of a joint filter, with restarts.

    Args:
        grid: `steering_wheel_angle` and `steering_motor_torque` at the settings' tick.
        settings: the first guess, and the noise.
        make: `joint_ekf`, `joint_ukf`, or one with other weights.
    """
    observer = make(settings)
    program = compile(observer)
    passes: list[Pass] = []
    rung, here = 0, settings
    while True:
        out = program.advance(grid, here.carry)[1]
        passes.append(_judged(out, here.guess, grid.time))
        if not passes[-1].why_not:
            break
        rung += 1
        if rung >= len(LADDER):
            break
        if passes[-1].lost:
            guess = settings.guess[0] * LADDER[rung][0], settings.guess[1] * LADDER[rung][1]
            a, w, J, b = here.start_variance
            here = replace(here, guess=guess, start_variance=(a, w, J / 2, b / 2))
        else:
            here = replace(here, guess=passes[-1].values)
        if here.keep != "free":
            # Floors and scales of the parameters belong to the guess, and are compiled in.
            program = compile(make(here))
    return Passes(observer.name, tuple(passes))


def _judged(out: dict[str, Array], guess: tuple[float, float], time: Array) -> Pass:
    """A pass from the filter's outputs."""
    path = np.column_stack([out[name] for name in NAMES])
    sds = np.column_stack([out[f"{name}_sd"] for name in NAMES])
    positive = np.all(path > 0, axis=1)
    with np.errstate(all="ignore"):
        e = out["steering_wheel_angle_innovation"] / out["steering_wheel_angle_innovation_sd"]
        nis = float(np.mean(e**2))
    why = ""
    if not (positive.all() and np.isfinite(path).all()):
        at = float(time[int(np.argmin(positive))])
        why = f"J_s or b_s was not positive, or not finite, at {at:.2f} s"
    else:
        moved = float(np.abs(np.log(path[-1] / path[3 * len(path) // 4])).max())
        share = float((sds[-1] / path[-1]).max())
        if moved > max(SETTLED, 3 * share):
            why = f"still changing: {moved:.0%} over the last quarter"
        elif not share <= SURE:
            why = f"unsure: a standard deviation of {share:.0%}"
    J, b = (float(x) for x in path[-1])
    guess = float(guess[0]), float(guess[1])
    return Pass(guess, (J, b), (float(sds[-1, 0]), float(sds[-1, 1])), nis, why, path, sds)
