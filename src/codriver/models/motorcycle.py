"""Sharp's motorcycle: two rigid bodies and tyres that take a length to build up their force, linear about riding straight ahead.

    E x' = (A_0 + v A_1) x + B tau                                       (5)-(11), linear in the speed v, m/s, and exactly so
    x = (phi, delta, v_y, r, phi', delta', Y_f, Y_r)

phi roll, rad; delta steer about the steer axis, rad; v_y lateral velocity of the point on the road below the rear frame's mass
centre, m/s; r yaw rate, rad/s; Y lateral force of a tyre, N; tau torque of the rider on the handlebar, N m. The rear frame holds
engine and rider, who does not move; the front frame is all that steers, wheel included. A tyre's force follows its slip alpha and
camber lambda over the relaxation length sigma (1)-(4):

    sigma / v Y' + Y = -C_1 alpha + C_2 lambda

    alpha_f = (v_y + l r - t delta') / v - delta cos eps        lambda_f = phi + delta sin eps
    alpha_r = (v_y - b r) / v                                   lambda_r = phi

With k = (a + e) cos eps - f sin eps, j = (a + e) sin eps + f cos eps, l = (a - t) / cos eps the coefficients are those of
`motorcycle_coefficients`. The speed is taken as constant: terms in dv/dt are left out. With relaxation neither v^2 nor 1/v occurs.

Sharp 1971 (J. Mech. Eng. Sci. 13(5), 316-329), doi:10.1243/JMES_JOUR_1971_013_051_02; numbered as in Damon, Ichalal, Arioui 2018,
whose (8) is for m_66 delta'', whose (2) needs a negative C_1, and whose r_86 is 0. Both papers' axes are x forward, y right, z
down. Ours are ISO 8855: roll stays as it is, all else that turns or points sideways is turned round (`ISO`, one line).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from codriver.models.lpv import LPV
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

STATES = (
    "roll_angle", "steer_angle", "lateral_velocity", "yaw_rate", "roll_rate", "steer_rate", "front_lateral_force",
    "rear_lateral_force",
)  # fmt: skip
INPUTS = ("rider_torque",)
MEASURED = ("steer_angle", "yaw_rate", "roll_rate", "steer_rate", "lateral_acceleration")
# From the papers' axes to ISO 8855 and back: roll to the right stays positive, everything else becomes positive to the left.
ISO = np.array([1.0, -1, -1, -1, 1, -1, -1, -1])
GRAVITY = 9.81  # m/s^2
# The paper's letter and the name in a vehicle file.
LETTERS = {
    "Mf": "front_frame_mass", "Mr": "rear_frame_mass", "Irx": "rear_frame_roll_inertia", "Irz": "rear_frame_yaw_inertia",
    "Crxz": "rear_frame_product_of_inertia", "Ifx": "front_frame_roll_inertia", "Ifz": "front_frame_steer_inertia",
    "ify": "front_wheel_spin_inertia", "iry": "rear_wheel_spin_inertia", "a": "steer_axis_distance",
    "b": "rear_axle_distance", "e": "front_frame_forward", "f": "front_frame_along", "h": "rear_frame_height",
    "Rf": "front_wheel_radius", "Rr": "rear_wheel_radius", "t": "normal_trail", "eps": "steer_axis_tilt",
    "Cf1": "front_cornering_stiffness", "Cf2": "front_camber_stiffness", "Cr1": "rear_cornering_stiffness",
    "Cr2": "rear_camber_stiffness", "sf": "front_relaxation_length", "sr": "rear_relaxation_length", "K": "steer_damping",
    "load": "front_wheel_load",
}  # fmt: skip


@dataclass(frozen=True)
class MotorcycleParameters:
    """The parameters, by Sharp's letters.

    Attributes:
        Mf, Mr: mass of the front and rear frame, kg.
        Irx, Irz, Crxz: of the rear frame about its mass centre: roll and yaw inertia, product of inertia, kg m^2.
        Ifx, Ifz: of the front frame about its mass centre: about the axis across the steer axis, and along it, kg m^2.
        ify, iry: of the wheels about their axles, what turns with them included, kg m^2.
        a: distance of the steer axis from the road point below the rear frame's mass centre, m.
        b: that point to the rear contact, m.
        e: mass centre of the front frame in front of the steer axis, m.
        f: mass centre of the front frame above the foot of a, along the steer axis, m.
        h: height of the rear frame's mass centre, m.
        Rf, Rr: radii of the wheels, m.
        t: normal trail: front contact to steer axis, m.
        eps: tilt of the steer axis, rad.
        Cf1, Cr1: cornering stiffness, N/rad, positive.
        Cf2, Cr2: camber stiffness, N/rad.
        sf, sr: relaxation lengths, m.
        K: steering damper, N m s/rad.
        load: static load of the front wheel, N: -Z_f.
        g: m/s^2.
    """

    Mf: float
    Mr: float
    Irx: float
    Irz: float
    Crxz: float
    Ifx: float
    Ifz: float
    ify: float
    iry: float
    a: float
    b: float
    e: float
    f: float
    h: float
    Rf: float
    Rr: float
    t: float
    eps: float
    Cf1: float
    Cf2: float
    Cr1: float
    Cr2: float
    sf: float
    sr: float
    K: float
    load: float
    g: float = GRAVITY

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> MotorcycleParameters:
        """A vehicle's motorcycle.

        Raises:
            VehicleError: the vehicle lacks a parameter.
        """
        return cls(**{letter: vehicle.number(name) for letter, name in LETTERS.items()})

    @property
    def mass(self) -> float:
        """Of both frames, kg."""
        return self.Mf + self.Mr

    @property
    def front(self) -> float:
        """l, m: the front contact in front of the road point below the rear frame's mass centre."""
        return (self.a - self.t) / cos(self.eps)


def motorcycle_coefficients(p: MotorcycleParameters) -> dict[str, float]:
    """m_ij and r_ij of (5)-(10) in the papers' axes, SI.

    Args:
        p: the machine.
    """
    c, s = cos(p.eps), sin(p.eps)
    k, j = (p.a + p.e) * c - p.f * s, (p.a + p.e) * s + p.f * c
    spin_f, spin = p.ify / p.Rf, p.ify / p.Rf + p.iry / p.Rr
    Zf = -p.load
    return {
        "m33": p.Mf + p.Mr, "m34": p.Mf * k, "m35": p.Mf * j + p.Mr * p.h, "m36": p.Mf * p.e,
        "m44": p.Mf * k**2 + p.Irz + p.Ifx * s**2 + p.Ifz * c**2,
        "m45": p.Mf * j * k - p.Crxz + (p.Ifz - p.Ifx) * s * c,
        "m46": p.Mf * p.e * k + p.Ifz * c,
        "m55": p.Mf * j**2 + p.Mr * p.h**2 + p.Irx + p.Ifx * c**2 + p.Ifz * s**2,
        "m56": p.Mf * p.e * j + p.Ifz * s,
        "m66": p.Ifz + p.Mf * p.e**2,
        "r34": -(p.Mf + p.Mr),
        "r44": -p.Mf * k, "r45": spin, "r46": spin_f * s, "r47": p.front, "r48": -p.b,
        "r51": (p.Mf * j + p.Mr * p.h) * p.g, "r52": p.Mf * p.e * p.g - p.t * Zf,
        "r54": -(p.Mf * j + p.Mr * p.h + spin), "r56": -spin_f * c,
        "r61": p.Mf * p.e * p.g - p.t * Zf, "r62": (p.Mf * p.e * p.g - p.t * Zf) * s,
        "r64": -(p.Mf * p.e + spin_f * s), "r65": spin_f * c, "r66": -p.K, "r67": -p.t,
        "r71": p.Cf2 / p.sf, "r72": (p.Cf1 * c + p.Cf2 * s) / p.sf, "r73": -p.Cf1 / p.sf, "r74": -p.Cf1 * p.front / p.sf,
        "r76": p.Cf1 * p.t / p.sf, "r77": -1 / p.sf,
        "r81": p.Cr2 / p.sr, "r83": -p.Cr1 / p.sr, "r84": p.Cr1 * p.b / p.sr, "r86": 0.0, "r88": -1 / p.sr,
    }  # fmt: skip


@dataclass(frozen=True, eq=False)
class MotorcycleMatrices:
    """E x' = (A_0 + v A_1) x + B tau in ISO axes.

    Attributes:
        E, A0, A1: shape (8, 8); of a state's own unit, see `STATES`.
        B: shape (8, 1).
    """

    E: Array
    A0: Array
    A1: Array
    B: Array


def motorcycle_matrices(p: MotorcycleParameters) -> MotorcycleMatrices:
    """The matrices of (11) before the masses are divided out.

    Args:
        p: the machine.
    """
    q = motorcycle_coefficients(p)
    E, A0, A1, B = np.eye(8), np.zeros((8, 8)), np.zeros((8, 8)), np.zeros((8, 1))
    for i, row in enumerate("3456"):
        for n, column in enumerate("3456"):
            E[2 + i, 2 + n] = q[f"m{min(row, column)}{max(row, column)}"]
    A0[0, 4] = A0[1, 5] = 1
    A0[2, 6] = A0[2, 7] = 1
    A0[3, 6], A0[3, 7] = q["r47"], q["r48"]
    A0[4, 0], A0[4, 1] = q["r51"], q["r52"]
    A0[5, 0], A0[5, 1], A0[5, 5], A0[5, 6] = q["r61"], q["r62"], q["r66"], q["r67"]
    A0[6, 2], A0[6, 3], A0[6, 5] = q["r73"], q["r74"], q["r76"]
    A0[7, 2], A0[7, 3], A0[7, 5] = q["r83"], q["r84"], q["r86"]
    A1[2, 3] = q["r34"]
    A1[3, 3], A1[3, 4], A1[3, 5] = q["r44"], q["r45"], q["r46"]
    A1[4, 3], A1[4, 5] = q["r54"], q["r56"]
    A1[5, 3], A1[5, 4] = q["r64"], q["r65"]
    A1[6, 0], A1[6, 1], A1[6, 6] = q["r71"], q["r72"], q["r77"]
    A1[7, 0], A1[7, 7] = q["r81"], q["r88"]
    B[5, 0] = 1
    turn = np.outer(ISO, ISO)
    return MotorcycleMatrices(E * turn, A0 * turn, A1 * turn, ISO[:, None] * B * -1)  # torque to the left


def motorcycle_model(p: MotorcycleParameters) -> LPV:
    """The motorcycle as x' = (A_0 + v A_1) x + B tau with the five measurements of (21).

    Lateral acceleration is (Y_f + Y_r) / M, as the paper has it: of both mass centres together, along the road.

    Args:
        p: the machine.
    """
    m = motorcycle_matrices(p)
    inverse = np.linalg.inv(m.E)
    C = np.zeros((5, 8))
    for row, name in enumerate(MEASURED[:4]):
        C[row, STATES.index(name)] = 1
    C[4, 6:] = 1 / p.mass
    return LPV({0: inverse @ m.A0, 1: inverse @ m.A1}, inverse @ m.B, C, STATES, INPUTS, MEASURED)
