"""The steer equation of a bicycle alone, with friction: how a fork moves under a torque, roll being measured.

    M_r phi'' + M_d delta'' + v (C_r phi' + C_d delta') + g (K_r phi + K_d delta) + v^2 K_2 delta + T_c f(delta') + T_0 = T

phi, roll, rad; delta, steer, rad; v, speed, m/s; T, torque on the handlebar or fork, N m. M_r, M_d in kg m^2, C and K in kg m, K_2
in kg. The second row of the linear bicycle (`codriver.models.bicycle`; Meijaard et al. 2007, doi:10.1098/rspa.2007.1857, eq.
(5.3)); its first row, with the pushes and gusts that nobody measures, is not needed where roll is measured. T_c, N m, is Coulomb
friction of the headset, f(w) = tanh(w / 0.05 rad/s); T_0, N m, what a steer or roll angle that is off makes. ISO 8855 signs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from codriver.models.bicycle import GRAVITY, BicycleMatrices
from codriver.models.state_space import StateSpace
from codriver.signals.signal import Array

SLIDING = 0.05  # rad/s: above it friction is that of sliding
KNOWN = ("roll_angle", "roll_rate", "roll_acceleration")


@dataclass(frozen=True)
class SteerRow:
    """The coefficients, named by the paper's matrices.

    Attributes:
        M_dphi, M_dd: kg m^2.
        C1_dphi, C1_dd: kg m.
        K0_dphi, K0_dd: kg m.
        K2_dd: kg.
        friction: T_c, N m.
        offset: T_0, N m.
        g: m/s^2.
    """

    M_dphi: float
    M_dd: float
    C1_dphi: float
    C1_dd: float
    K0_dphi: float
    K0_dd: float
    K2_dd: float
    friction: float = 0.0
    offset: float = 0.0
    g: float = GRAVITY

    @classmethod
    def of(cls, matrices: BicycleMatrices, friction: float = 0.0) -> SteerRow:
        """The steer row of a bicycle.

        Args:
            matrices: in ISO axes.
            friction: T_c, N m, which the paper's bicycle does not have.
        """
        m = matrices
        (M_dphi, M_dd), (C1_dphi, C1_dd), (K0_dphi, K0_dd) = m.M[1], m.C1[1], m.K0[1]
        return cls(M_dphi, M_dd, C1_dphi, C1_dd, K0_dphi, K0_dd, float(m.K2[1, 1]), friction, g=m.g)

    def with_values(self, **values: float) -> SteerRow:
        """A row that has these coefficients instead of its own."""
        return replace(self, **values)

    def torque(self, motion: SteerMotion) -> Array:
        """T that the motion needs, N m: the equation as it stands.

        Args:
            motion: what the bicycle does.
        """
        return np.asarray(sum(getattr(self, name) * column for name, column in motion.columns(self.g).items()))

    def drag(self, steer_rate: Array) -> Array:
        """The torque that friction and offset take, N m: what an observer without them adds to its estimate.

        Args:
            steer_rate: rad/s.
        """
        return np.asarray(self.friction * sliding(steer_rate) + self.offset)

    def model(self, speed: float) -> StateSpace:
        """Fork at a speed, without friction: unknown rider torque, known roll; the steer angle is measured.

        Args:
            speed: m/s.

        Raises:
            ValueError: M_dd is not positive.
        """
        if not self.M_dd > 0:
            raise ValueError(f"M_dd = {self.M_dd} kg m^2; it must be positive")
        stiffness = self.g * self.K0_dd + speed**2 * self.K2_dd
        roll = [self.g * self.K0_dphi, speed * self.C1_dphi, self.M_dphi]
        return StateSpace(
            A=np.array([[0, 1], [-stiffness / self.M_dd, -speed * self.C1_dd / self.M_dd]]),
            B=np.array([[0, 0, 0, 0], [1 / self.M_dd, *(-r / self.M_dd for r in roll)]]),
            C=np.array([[1.0, 0]]),
            D=np.zeros((1, 4)),
            states=("steer_angle", "steer_rate"),
            inputs=("rider_torque", *KNOWN),
            outputs=("steer_angle",),
        )


def sliding(steer_rate: Array) -> Array:
    """f of a rate in rad/s: the share of T_c that acts, from -1 to 1."""
    return np.asarray(np.tanh(steer_rate / SLIDING))


@dataclass(frozen=True, eq=False)
class SteerMotion:
    """What a bicycle does, arrays of one length: angles in rad, their rates and accelerations, speed in m/s.

    Attributes:
        sliding: f(delta'), from -1 to 1. Where the others are filtered it is the filtered f, not f of the filtered rate, which
            would round off the turning points and take a third of the friction away.
    """

    roll: Array
    roll_rate: Array
    roll_acceleration: Array
    steer: Array
    steer_rate: Array
    steer_acceleration: Array
    sliding: Array
    speed: Array

    def columns(self, g: float) -> dict[str, Array]:
        """What each coefficient of a `SteerRow` is multiplied by."""
        v = self.speed
        return {
            "M_dphi": self.roll_acceleration,
            "M_dd": self.steer_acceleration,
            "C1_dphi": v * self.roll_rate,
            "C1_dd": v * self.steer_rate,
            "K0_dphi": g * self.roll,
            "K0_dd": g * self.steer,
            "K2_dd": v**2 * self.steer,
            "friction": self.sliding,
            "offset": np.ones_like(v),
        }
