"""Sharp's motorcycle at any lean: roll enters by its sine and cosine, steer stays small, tyres have a round section and a trail.

    d/dt dT/dv_y + W dT/dv = Y_f + Y_r                                  along the road, to the left
    d/dt dT/dW + v dT/dv_y - v_y dT/dv = l Y_f - b Y_r + M_z            about the road's normal
    d/dt dT/dphi' - d(T - V)/dphi = Q_phi,   d/dt dT/ddelta' - d(T - V)/ddelta = Q_delta + tau
    sigma Y' = -C_1 (w - v Delta) - u C_2 lambda - u Y                  each tyre

Lagrange's equations in the velocities v, v_y of the road point and the yaw rate W about the road's normal, ISO 8855 (`STATES` of
`motorcycle`). A point X ahead and Z up in the plane of the machine, n to its left, is at

    y = -Z sin phi + n cos phi,   z = rho (1 - cos phi) + Z cos phi + n sin phi

The front frame's mass centre has n = e delta. rho is the crown radius of the tyres' sections, straight between both along X: the
wheels roll on it when the machine leans, so that the contacts move by rho sin phi to the side of the lean. Then

    w_f = v_y + l W + rho_f (1 - cos phi) phi' - (t cos phi + rho_f sin eps (1 - cos phi)) delta'    lateral velocity, front contact
    w_r = v_y - b W + rho_r (1 - cos phi) phi'                                                       rear
    Delta = delta cos eps / cos phi,   lambda_f = phi - delta sin eps,   lambda_r = phi

Forces do the work that these velocities say. The pneumatic trail t_p adds -t_p Y about the road's normal. The air's drag acts at
the height h, what drives at the rear contact, what brakes at the front one: with v' they make the moments that Sharp's model leaves
out, and move load from wheel to wheel, which camber stiffness and trail follow. u is the speed, or `SLOWEST` below it: there the
tyre is a spring with some damping.

At phi = 0 without crown, trail, drag and v' this is Sharp's model to the last digits. Left out: pitch, squares of steer,
saturation. Where Sharp prints no pitch inertia, frames are taken as flat: that about y is the sum of the other two.

Sharp 1971, doi:10.1243/JMES_JOUR_1971_013_051_02; the crown: Cossalter 2006 (Motorcycle Dynamics, 2nd ed.), chapters 1, 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, sin
from typing import Any

from codriver.kernel.expressions import select
from codriver.models.motorcycle import STATES, MotorcycleParameters
from codriver.vehicles import Vehicle

# A CasADi SX; CasADi ships no types.
Value = Any
SLOWEST = 1.0  # m/s
# Of usual road tyres and machines, where the vehicle does not say.
USUAL = {
    "front_crown_radius": 0.05, "rear_crown_radius": 0.09, "pneumatic_trail": 0.02, "drag": 0.36,
    "imu_forward": 0.0, "imu_left": 0.0, "imu_height": 0.8,
}  # fmt: skip


@dataclass(frozen=True)
class LeanParameters:
    """The machine.

    Attributes:
        sharp: masses, geometry, tyres as Sharp has them.
        front_crown, rear_crown: radius of the tyre's section, m.
        pneumatic_trail: t_p of both tyres, m.
        drag: force of the air per speed squared, kg/m.
        imu: place of the IMU in the rear frame, from the road point below its mass centre when upright, m: forward, left, up.
    """

    sharp: MotorcycleParameters
    front_crown: float = USUAL["front_crown_radius"]
    rear_crown: float = USUAL["rear_crown_radius"]
    pneumatic_trail: float = USUAL["pneumatic_trail"]
    drag: float = USUAL["drag"]
    imu: tuple[float, float, float] = (USUAL["imu_forward"], USUAL["imu_left"], USUAL["imu_height"])

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> LeanParameters:
        """A vehicle's motorcycle; what it lacks beyond Sharp's parameters is that of `USUAL`.

        Raises:
            VehicleError: it lacks one of Sharp's.
        """
        own = {name: vehicle.number(name) if name in vehicle else value for name, value in USUAL.items()}
        return cls(
            MotorcycleParameters.from_vehicle(vehicle), own["front_crown_radius"], own["rear_crown_radius"],
            own["pneumatic_trail"], own["drag"], (own["imu_forward"], own["imu_left"], own["imu_height"]),
        )  # fmt: skip

    @property
    def height(self) -> float:
        """Of the whole machine's mass centre, m."""
        q = self.sharp
        return (q.Mf * ((q.a + q.e) * sin(q.eps) + q.f * cos(q.eps)) + q.Mr * q.h) / q.mass

    def crown(self, X: float) -> float:
        """rho at X ahead of the road point, m."""
        p = self.sharp
        return self.rear_crown + (self.front_crown - self.rear_crown) * (X + p.b) / (p.front + p.b)


# What the rates depend on: the linear model's states, the rider's torque, a moment about the road that leans to the right, N m.
LEAN_STATES = (*STATES, "rider_torque", "roll_moment")


def lean_functions(p: LeanParameters) -> tuple[Value, Value]:
    """CasADi functions of (x, v, v', sin phi, cos phi), x as in `LEAN_STATES`.

    Args:
        p: the machine.

    Returns:
        the rates of the first eight states, shape (8, 1), and with their Jacobian, shape (8, 10). Sine and cosine are arguments
        so that they are computed once; the Jacobian knows that they go with phi.
    """
    import casadi as ca

    x, v, dv, S, C = (ca.SX.sym(name, size) for name, size in (("x", 10), ("v", 1), ("dv", 1), ("S", 1), ("C", 1)))

    def by_state(value: Value) -> Value:
        whole = ca.jacobian(value, x)
        turned = ca.jacobian(value, S) * C - ca.jacobian(value, C) * S
        return ca.horzcat(whole[:, 0] + turned, whole[:, 1:])

    mass, force, tyres = _equations(p, x, v, dv, S, C, by_state)
    lower, diagonal, order = ca.ldl(mass)
    inverse = ca.ldl_solve(ca.SX.eye(4), lower, diagonal, order)
    rates = ca.SX.sym("a", 4)
    found = inverse @ force
    bent = ca.substitute(by_state(force - mass @ rates), rates, found)
    rows = ca.SX(2, 10)
    rows[0, 4] = rows[1, 5] = 1
    f = ca.vertcat(x[4], x[5], found, tyres)
    A = ca.vertcat(rows, inverse @ bent, by_state(tyres))
    given = [x, v, dv, S, C]
    return ca.Function("rates", given, ca.cse([f])), ca.Function("linear", given, ca.cse([f, A]))


def _equations(
    p: LeanParameters, x: Value, v: Value, dv: Value, S: Value, C: Value, by_state: Callable[[Value], Value]
) -> tuple[Value, Value, Value]:
    """M, shape (4, 4), and the right side of M a, shape (4, 1), a = (v_y', W', phi'', delta''); Y', shape (2, 1)."""
    import casadi as ca

    q = p.sharp
    phi, d, v_y, W, w, dd, Y_f, Y_r, tau, M_phi = (x[i] for i in range(10))
    moving = ca.vertcat(v_y, W, w, dd)
    # v for the wheels' spin, whose rate is a coordinate of its own, and the front wheel's load.
    spin, load = ca.SX.sym("spin"), ca.SX.sym("load")
    T, V = _energies(p, d, moving, v, spin, load, S, C)
    momentum = ca.gradient(T, moving)
    along = ca.gradient(T, v)
    mass = ca.jacobian(momentum, moving)
    drift = by_state(momentum)[:, :2] @ ca.vertcat(w, dd) + ca.jacobian(momentum, v) * dv
    potential = by_state(T - V)[:, :2].T

    ce, se, t_p = cos(q.eps), sin(q.eps), p.pneumatic_trail
    bulge = 1 - C
    D = p.drag * v * v
    F = q.mass * dv + D  # along the road, from the tyres
    drives, brakes = select(F > 0, F, 0.0), select(F > 0, 0.0, F)
    shift = F * C * p.height / (q.front + q.b)
    N_f = select(shift > 0.8 * q.load, 0.2 * q.load, q.load - shift)
    rear_load = q.mass * q.g - q.load
    front_share, rear_share = N_f / q.load, (rear_load + q.load - N_f) / rear_load
    trail = q.t * C + p.front_crown * se * bulge
    M_z = -t_p * (Y_f + Y_r) + S * (p.rear_crown * drives + p.front_crown * brakes - q.h * D)
    force = ca.vertcat(
        Y_f + Y_r - W * along,
        q.front * Y_f - q.b * Y_r + M_z - v * momentum[0] + v_y * along,
        bulge * (p.front_crown * Y_f + p.rear_crown * Y_r) + potential[0] + M_phi,
        tau - q.K * dd - trail * Y_f - t_p * ce * C * Y_f + p.front_crown * ce * S * brakes + potential[1],
    ) - drift  # fmt: skip

    u = select(v > SLOWEST, v, SLOWEST)
    w_f = v_y + q.front * W + p.front_crown * bulge * w - trail * dd
    w_r = v_y - q.b * W + p.rear_crown * bulge * w
    tyres = ca.vertcat(
        (-q.Cf1 * (w_f - v * d * ce / C) - u * (q.Cf2 * front_share * (phi - d * se) + Y_f)) / q.sf,
        (-q.Cr1 * w_r - u * (q.Cr2 * rear_share * phi + Y_r)) / q.sr,
    )
    return mass, ca.substitute(ca.substitute(force, spin, v), load, N_f), tyres


def _energies(
    p: LeanParameters, d: Value, moving: Value, v: Value, spin: Value, load: Value, S: Value, C: Value
) -> tuple[Value, Value]:
    """Kinetic energy, with the spinning wheels' share that is linear in the turn rates, and the potential one, J."""
    q = p.sharp
    v_y, W, w, dd = (moving[i] for i in range(4))
    ce, se = cos(q.eps), sin(q.eps)
    k, j = (q.a + q.e) * ce - q.f * se, (q.a + q.e) * se + q.f * ce
    low, low_k = q.h - p.crown(0.0), j - p.crown(k)
    T = q.Mr / 2 * ((v + W * q.h * S) ** 2 + (v_y - q.h * C * w) ** 2 + (low * S * w) ** 2)
    T += (q.Irx * w**2 + (q.Irx + q.Irz) * (W * S) ** 2 + q.Irz * (W * C) ** 2) / 2 + q.Crxz * w * W * C
    ahead = v + W * (j * S - q.e * d * C)
    left = v_y + k * W - j * C * w + q.e * (dd * C - d * S * w)
    up = -low_k * S * w + q.e * (dd * S + d * C * w)
    across, about, along = ce * w + se * W * C, W * S, -se * w + ce * W * C + dd
    axle = about - d * across
    T += q.Mf / 2 * (ahead**2 + left**2 + up**2)
    T += (q.Ifx * (across + d * about) ** 2 + (q.Ifx + q.Ifz) * axle**2 + q.Ifz * along**2) / 2
    T += spin * (q.ify / q.Rf * axle + q.iry / q.Rr * about)
    arm = q.Mf * q.e * q.g + load * (q.t - p.front_crown * se)
    return T, q.g * (q.Mr * low + q.Mf * low_k) * C + arm * (d * S - d * d / 2 * se * C)
