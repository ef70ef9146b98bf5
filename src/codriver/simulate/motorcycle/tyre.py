"""A motorcycle tyre: magic formula of slip and camber, degressive in load, friction shared with the longitudinal force.

    Y_0 = D sin(C atan(B x - E (B x - atan(B x)))),   D = mu N,   B C D = K(N),   x = -tan(alpha) - (K_2 / K) gamma
    K = C_1 sin(2 atan(N / n)) / sin(2 atan(N_0 / n)),   K_2 = C_2 N / N_0,   n = peak load
    X_0 likewise of the slip kappa,   Y = Y_0 sqrt(1 - (X / D)^2)
    M_z = -t_p Y,   t_p = t_0 / (1 + (B tan(alpha))^2)

alpha slip angle, rad; gamma camber to the right, rad; N load, N, N_0 the static one; all sideways forces positive to the left. The
relaxation of the forces is the machine's. The twisting moment of camber and the rolling resistance are left out.
Pacejka 2012 (Tire and Vehicle Dynamics, 3rd ed.), chapter 4, doi:10.1016/C2010-0-68548-8.
"""

from __future__ import annotations

import casadi as ca

from codriver.simulate.motorcycle.parameters import TyreParameters


def magic(stiffness: ca.SX, peak: ca.SX, slip: ca.SX, tyre: TyreParameters) -> ca.SX:
    """The magic formula of one slip.

    Args:
        stiffness: slope at no slip, N.
        peak: greatest force, N.
        slip: without unit.
        tyre: shape and curvature.
    """
    x = stiffness / (tyre.shape * peak) * slip
    return peak * ca.sin(tyre.shape * ca.atan(x - tyre.curvature * (x - ca.atan(x))))


def cornering_stiffness(load: ca.SX, static: float, at_static: float, tyre: TyreParameters) -> ca.SX:
    """K, N/rad.

    Args:
        load: N.
        static: load, N.
        at_static: the stiffness there, N/rad.
        tyre: gives the load of the greatest stiffness.
    """
    n = tyre.peak_load * static
    return at_static * ca.sin(2 * ca.atan(load / n)) / ca.sin(2 * ca.atan(static / n))


def steady_forces(
    load: ca.SX, tan_slip: ca.SX, camber: ca.SX, kappa: ca.SX, longitudinal: ca.SX, static: float,
    stiffnesses: tuple[float, float], tyre: TyreParameters,
) -> tuple[ca.SX, ca.SX, ca.SX]:  # fmt: skip
    """The forces that the tyre settles to, and its trail.

    Args:
        load: N, positive.
        tan_slip: tan(alpha).
        camber: gamma, rad.
        kappa: longitudinal slip, positive when driving.
        longitudinal: force that the tyre has now, N.
        static: load, N.
        stiffnesses: C_1 and C_2 at that load, N/rad.
        tyre: the rest.

    Returns:
        Longitudinal force, N; lateral force, N; pneumatic trail, m.
    """
    peak = tyre.friction * load
    k1 = cornering_stiffness(load, static, stiffnesses[0], tyre)
    k2 = stiffnesses[1] * load / static
    left = ca.sqrt(ca.fmax(1 - (longitudinal / peak) ** 2, 0.01))
    lateral = magic(k1, peak, -tan_slip - k2 / k1 * camber, tyre) * left
    trail = tyre.pneumatic_trail / (1 + (k1 / (tyre.shape * peak) * tan_slip) ** 2)
    return magic(tyre.slip_stiffness * load, peak, kappa, tyre), lateral, trail
