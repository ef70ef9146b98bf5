"""The bicycle with a rigid rider, linear about riding straight ahead: the Whipple or Carvallo model.

    M q'' + v C1 q' + (g K0 + v^2 K2) q = f,   q = (roll phi, steer delta), rad,   f = (roll moment, steer torque), N m

v is the speed, m/s; M in kg m^2, C1 in kg m, K0 in kg m, K2 in kg. Four rigid bodies, knife-edge wheels that roll without
slip: rear wheel R, rear frame with rider B, fork with handlebar H, front wheel F. No tyre slip, no frame flex, no friction
in the headset, no arms that move.

Meijaard, Papadopoulos, Ruina, Schwab 2007, doi:10.1098/rspa.2007.1857, appendix A: the equations here are theirs, by number.
Their axes are x forward, y right, z down, so roll and steer are both positive to the right. Ours are ISO 8855: roll is
positive to the right, steer and the torque on the handlebar are positive to the left (`to_iso`, one line).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from codriver.models.lpv import LPV
from codriver.models.state_space import StateSpace
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

STATES = ("roll_angle", "steer_angle", "roll_rate", "steer_rate")
INPUTS = ("roll_moment", "rider_torque")
GRAVITY = 9.81  # m/s^2
# The paper's letter and the name in a vehicle file, where heights are positive.
LETTERS = {
    "w": "wheelbase", "c": "trail", "lam": "steer_axis_tilt", "rR": "rear_wheel_radius", "mR": "rear_wheel_mass",
    "IRxx": "rear_wheel_inertia", "IRyy": "rear_wheel_spin_inertia", "xB": "frame_forward", "zB": "frame_height",
    "mB": "frame_mass", "IBxx": "frame_roll_inertia", "IBxz": "frame_product_of_inertia", "IBzz": "frame_yaw_inertia",
    "xH": "fork_forward", "zH": "fork_height", "mH": "fork_mass", "IHxx": "fork_roll_inertia",
    "IHxz": "fork_product_of_inertia", "IHzz": "fork_yaw_inertia", "rF": "front_wheel_radius", "mF": "front_wheel_mass",
    "IFxx": "front_wheel_inertia", "IFyy": "front_wheel_spin_inertia",
}  # fmt: skip


@dataclass(frozen=True)
class BicycleParameters:
    """The 25 parameters of the paper's table 1, in its axes (z down, so heights are negative), symbols and units.

    Moments of inertia in y of frame and fork do not matter to the linear model and are left out.

    Attributes:
        w: wheelbase, m.
        c: trail, m.
        lam: steer axis tilt, rad.
        g: gravity, m/s^2.
        rR, mR, IRxx, IRyy: rear wheel: radius, m; mass, kg; inertia, kg m^2.
        xB, zB, mB, IBxx, IBxz, IBzz: rear frame with the rider: centre of mass, m; mass; inertia.
        xH, zH, mH, IHxx, IHxz, IHzz: fork and handlebar.
        rF, mF, IFxx, IFyy: front wheel.
    """

    w: float
    c: float
    lam: float
    rR: float
    mR: float
    IRxx: float
    IRyy: float
    xB: float
    zB: float
    mB: float
    IBxx: float
    IBxz: float
    IBzz: float
    xH: float
    zH: float
    mH: float
    IHxx: float
    IHxz: float
    IHzz: float
    rF: float
    mF: float
    IFxx: float
    IFyy: float
    g: float = GRAVITY

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> BicycleParameters:
        """A vehicle's bicycle.

        Raises:
            VehicleError: the vehicle lacks a parameter.
        """
        own = {letter: vehicle.number(name) for letter, name in LETTERS.items()}
        return cls(**{**own, "zB": -own["zB"], "zH": -own["zH"]})


@dataclass(frozen=True, eq=False)
class BicycleMatrices:
    """The canonical matrices, shape (2, 2) each, rows and columns (roll, steer).

    Attributes:
        M, C1, K0, K2: see the module's docstring.
        g: gravity, m/s^2.
    """

    M: Array
    C1: Array
    K0: Array
    K2: Array
    g: float = GRAVITY

    def to_iso(self) -> BicycleMatrices:
        """The same bicycle with steer turned round: from the paper's axes to ISO 8855, or back."""
        turn = np.array([[1, -1], [-1, 1]])
        return BicycleMatrices(self.M * turn, self.C1 * turn, self.K0 * turn, self.K2 * turn, self.g)

    def at(self, speed: float) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness at a speed: M, v C1, g K0 + v^2 K2.

        Args:
            speed: v, m/s.
        """
        return self.M, speed * self.C1, self.g * self.K0 + speed**2 * self.K2


def bicycle_matrices(p: BicycleParameters) -> BicycleMatrices:
    """The canonical matrices from the 25 parameters, in the paper's axes; equations (A 1) to (A 24)."""
    # the whole bicycle, (A 1)-(A 4)
    m_T = p.mR + p.mB + p.mH + p.mF
    x_T = (p.xB * p.mB + p.xH * p.mH + p.w * p.mF) / m_T
    z_T = (-p.rR * p.mR + p.zB * p.mB + p.zH * p.mH - p.rF * p.mF) / m_T
    I_Txx = p.IRxx + p.IBxx + p.IHxx + p.IFxx
    I_Txx += p.mR * p.rR**2 + p.mB * p.zB**2 + p.mH * p.zH**2 + p.mF * p.rF**2
    # (A 5)-(A 7); thin wheels have the same inertia about x and z
    I_Txz = p.IBxz + p.IHxz - p.mB * p.xB * p.zB - p.mH * p.xH * p.zH + p.mF * p.w * p.rF
    I_Tzz = p.IRxx + p.IBzz + p.IHzz + p.IFxx + p.mB * p.xB**2 + p.mH * p.xH**2 + p.mF * p.w**2
    # the front assembly A, (A 8)-(A 12)
    m_A = p.mH + p.mF
    x_A, z_A = (p.xH * p.mH + p.w * p.mF) / m_A, (p.zH * p.mH - p.rF * p.mF) / m_A
    I_Axx = p.IHxx + p.IFxx + p.mH * (p.zH - z_A) ** 2 + p.mF * (p.rF + z_A) ** 2
    I_Axz = p.IHxz - p.mH * (p.xH - x_A) * (p.zH - z_A) + p.mF * (p.w - x_A) * (p.rF + z_A)
    I_Azz = p.IHzz + p.IFxx + p.mH * (p.xH - x_A) ** 2 + p.mF * (p.w - x_A) ** 2
    # its distance in front of the steer axis, and its inertia about that axis, (A 13)-(A 16)
    s, k = sin(p.lam), cos(p.lam)
    u_A = (x_A - p.w - p.c) * k - z_A * s
    I_All = m_A * u_A**2 + I_Axx * s**2 + 2 * I_Axz * s * k + I_Azz * k**2
    I_Alx = -m_A * u_A * z_A + I_Axx * s + I_Axz * k
    I_Alz = m_A * u_A * x_A + I_Axz * s + I_Azz * k
    # trail over wheelbase; angular momentum of the wheels over speed; static moment, (A 17)-(A 19)
    mu = p.c / p.w * k
    S_R, S_F = p.IRyy / p.rR, p.IFyy / p.rF
    S_T, S_A = S_R + S_F, m_A * u_A + mu * m_T * x_T
    M_rd = I_Alx + mu * I_Txz
    K0_rd = -S_A
    return BicycleMatrices(
        M=np.array([[I_Txx, M_rd], [M_rd, I_All + 2 * mu * I_Alz + mu**2 * I_Tzz]]),  # (A 20)
        K0=np.array([[m_T * z_T, K0_rd], [K0_rd, -S_A * s]]),  # (A 22)
        K2=np.array([[0, (S_T - m_T * z_T) / p.w * k], [0, (S_A + S_F * s) / p.w * k]]),  # (A 23)
        C1=np.array(  # (A 24)
            [
                [0, mu * S_T + S_F * k + I_Txz / p.w * k - mu * m_T * z_T],
                [-(mu * S_T + S_F * k), I_Alz / p.w * k + mu * (S_A + I_Tzz / p.w * k)],
            ]
        ),
        g=p.g,
    )


def bicycle_model(matrices: BicycleMatrices, speed: float) -> StateSpace:
    """The bicycle at a speed: states roll, steer and their rates; inputs roll moment and rider torque; all states measured.

    Args:
        matrices: in ISO axes (`BicycleMatrices.to_iso`).
        speed: m/s.
    """
    M, C, K = matrices.at(speed)
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ K, -inverse @ C]])
    return StateSpace(
        A=A,
        B=np.vstack([np.zeros((2, 2)), inverse]),
        C=np.eye(4),
        D=np.zeros((4, 2)),
        states=STATES,
        inputs=INPUTS,
        outputs=STATES,
    )


def bicycle_lpv(matrices: BicycleMatrices) -> LPV:
    """The bicycle at all speeds: A is quadratic in the speed. Inputs, states and outputs are those of `bicycle_model`.

    Args:
        matrices: in ISO axes (`BicycleMatrices.to_iso`).
    """
    inverse, Z = np.linalg.inv(matrices.M), np.zeros((2, 2))
    parts = {
        0: [[Z, np.eye(2)], [-inverse @ matrices.K0 * matrices.g, Z]],
        1: [[Z, Z], [Z, -inverse @ matrices.C1]],
        2: [[Z, Z], [-inverse @ matrices.K2, Z]],
    }
    return LPV(
        {k: np.block(part) for k, part in parts.items()}, np.vstack([Z, inverse]), np.eye(4), STATES, INPUTS, STATES
    )
