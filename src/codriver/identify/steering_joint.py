"""The joint state of the wheel and its parameters, and what a filter of it starts from.

    z = (delta_s, omega_s, J_s, b_s),     z+ = f(z, T) + w,     y = delta_s + v                                       (55)-(56)

f is Euler's step (77); J_s and b_s stay as they are but for w. Its Jacobian comes from CasADi. With the right entries of the
misprinted (81), and those of Box I:

    d omega+ / d J_s = dt (b_s omega - T) / J_s^2,     d omega+ / d b_s = -dt omega / J_s

Nothing in z keeps J_s positive, and a filter that passes 0 is lost. Two remedies: `keep` = "log" estimates ln J_s and ln b_s
(variances are those of J_s, b_s over the guess squared), "bounds" holds both above a share of the guess.
Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 3.2 and eq. (77)-(86).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import log, pi
from typing import Any

from codriver.errors import UsageError
from codriver.kernel import Scalar
from codriver.models.steering import tick_of
from codriver.observers.observer import Output

KEEPS = ("free", "log", "bounds")
FLOOR = 0.1  # share of the guess, below which "bounds" lets no parameter fall
WIDEST = 1.0  # variance of ln J_s or ln b_s at the start, at most
PAIRS = [(i, k) for i in range(4) for k in range(i, 4)]
OUTPUTS = (
    Output("steering_wheel_angle", "rad", "estimate", "angle of the wheel"),
    Output("steering_wheel_rate", "rad/s", "estimate", "its rate"),
    Output("steering_inertia", "kg*m^2", "estimate", "J_s"),
    Output("steering_damping", "N*m*s/rad", "estimate", "b_s"),
    Output("steering_wheel_angle_sd", "rad", "sd"),
    Output("steering_wheel_rate_sd", "rad/s", "sd"),
    Output("steering_inertia_sd", "kg*m^2", "sd"),
    Output("steering_damping_sd", "N*m*s/rad", "sd"),
    Output("steering_wheel_angle_innovation", "rad", "innovation", "measured less predicted angle"),
    Output("steering_wheel_angle_innovation_sd", "rad", "innovation_sd"),
)


@dataclass(frozen=True)
class JointSettings:
    """What a joint filter starts from; the values are those of eq. (85)-(86), the angle in radians.

    Attributes:
        guess: J_s and b_s to start from, kg m^2 and N m s/rad.
        start: angle and rate to start from, rad and rad/s.
        start_variance: diagonal of Phi(0), in the units of z squared.
        process: diagonal of Q_z, gathered each tick.
        angle: R, rad^2.
        dt: tick, s.
        keep: "free" as in the paper, "log" or "bounds".
    """

    guess: tuple[float, float]
    start: tuple[float, float] = (0.0, 0.0)
    start_variance: tuple[float, float, float, float] = (1.0, 1.0, 8e-3, 0.1)
    process: tuple[float, float, float, float] = (0.01, 0.01, 5e-8, 5e-8)
    angle: float = 0.01 * (pi / 180) ** 2
    dt: float = 0.01
    keep: str = "free"

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            UsageError: an unknown `keep`, or numbers that are not positive.
        """
        if self.keep not in KEEPS:
            raise UsageError(f"keep = '{self.keep}'", f"one of {', '.join(KEEPS)}", "choose one")
        if not (min(*self.guess, *self.start_variance, self.angle, self.dt) > 0 and min(self.process) >= 0):
            raise UsageError(
                f"guess {self.guess}, variances {self.start_variance}, {self.process}, {self.angle}, dt {self.dt}",
                "positive numbers", "correct them",
            )  # fmt: skip

    @property
    def process_in_z(self) -> tuple[float, float, float, float]:
        """Diagonal of Q_z in the coordinates of the filter."""
        return self._scaled(self.process)

    @property
    def carry(self) -> dict[str, float]:
        """The filter's carry at the start."""
        J, b = self.guess
        z = (*self.start, log(J), log(b)) if self.keep == "log" else (*self.start, J, b)
        variance = self._scaled(self.start_variance)
        if self.keep == "log":
            variance = (*variance[:2], min(variance[2], WIDEST), min(variance[3], WIDEST))
        P = {f"P_{i}{k}": variance[i] if i == k else 0.0 for i, k in PAIRS}
        return {"started": 0.0, "torque_before": 0.0, **{f"z_{i}": z[i] for i in range(4)}, **P}

    def describe(self) -> dict[str, str | float]:
        """For provenance."""
        return {
            "guess": f"{self.guess[0]:g}, {self.guess[1]:g}", "keep": self.keep, "R": self.angle,
            "Q": ", ".join(f"{q:g}" for q in self.process),
        }  # fmt: skip

    def _scaled(self, variance: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        """Variances of z from those of (angle, rate, J_s, b_s)."""
        if self.keep != "log":
            return variance
        J, b = self.guess
        return variance[0], variance[1], variance[2] / J**2, variance[3] / b**2


@cache
def joint_functions(dt: float, logarithmic: bool) -> tuple[Any, Any]:
    """f(z, T) and its Jacobian by z, as CasADi functions.

    Args:
        dt: tick, s.
        logarithmic: z holds ln J_s and ln b_s.
    """
    import casadi as ca

    z, torque = ca.SX.sym("z", 4), ca.SX.sym("T")
    J, b = (ca.exp(z[2]), ca.exp(z[3])) if logarithmic else (z[2], z[3])
    angle, rate = tick_of(J, b, dt, "euler").advance(z[0], z[1], torque)
    after = ca.vertcat(angle, rate, z[2], z[3])
    return ca.Function("f", [z, torque], [after]), ca.Function("J_z", [z, torque], [ca.jacobian(after, z)])


def physical(z: Any, P: Any, settings: JointSettings) -> tuple[list[Scalar], list[Scalar]]:
    """(angle, rate, J_s, b_s) and their standard deviations, from z and its covariance."""
    from codriver.kernel import sqrt

    values, sds = [z[i] for i in range(4)], [sqrt(P[i, i]) for i in range(4)]
    if settings.keep == "log":
        import casadi as ca

        values[2:] = [ca.exp(z[2]), ca.exp(z[3])]
        sds[2:] = [values[2] * sds[2], values[3] * sds[3]]
    return values, sds


def held_up(z: list[Scalar], settings: JointSettings) -> list[Scalar]:
    """z with its parameters above their floors, where the settings ask for it."""
    from codriver.kernel import select

    if settings.keep != "bounds":
        return z
    J, b = (FLOOR * guess for guess in settings.guess)
    return [z[0], z[1], select(z[2] < J, J, z[2]), select(z[3] < b, b, z[3])]
