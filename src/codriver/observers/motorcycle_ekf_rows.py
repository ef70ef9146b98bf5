"""What an IMU, a steering encoder and their biases make of the state of the motorcycle's large-angle filter (`motorcycle_ekf`)."""

from __future__ import annotations

from codriver.kernel import Scalar
from codriver.models.motorcycle_lean import LeanParameters
from codriver.observers.motorcycle_ekf_states import BIASES, LEAN, LEANING, PITCHING, ROLL, TURN, N


def sensor_function(p: LeanParameters, states: int = N) -> Scalar:
    """CasADi function of what the sensors should show, h(x), as `motorcycle_ekf` writes it, and H = dh/dx.

    It is (x, a, bent, v, sin phi, cos phi) -> (h, H, a_z): a = (v_y', W', phi''), bent its derivatives by the first ten states,
    shape (3, 10); h as `ROWS`, rad/s, m/s^2, rad, shape (6, 1), H of shape (6, n), a_z in m/s^2.

    Args:
        p: the machine.
        states: n, 16, or 17 with the encoder's zero.
    """
    import casadi as ca

    X, n, Z = p.imu
    rho, g = p.crown(X), p.sharp.g
    x, a, bent = ca.SX.sym("x", states), ca.SX.sym("a", 3), ca.SX.sym("bent", 3, LEAN)
    v, S, C = (ca.SX.sym(name) for name in ("v", "S", "C"))
    W, w, b = x[TURN], x[LEANING], x[BIASES:]
    shown = x[1] + x[N] if states > N else x[1]
    swing, lift = a[2] * C - w * w * S, a[2] * S + w * w * C
    side = a[0] + v * W + X * a[1] - Z * swing - n * lift + W * W * (Z * S - n * C)
    up = (rho - Z) * lift + n * swing + g
    rows = ca.vertcat(
        w + b[0], x[PITCHING] + W * S + b[1], W * C + b[2], side * C + up * S + b[3], up * C - side * S + b[4], shown
    )
    H = ca.jacobian(rows, x)
    H[:, ROLL] += ca.jacobian(rows, S) * C - ca.jacobian(rows, C) * S
    H[:, :LEAN] += ca.jacobian(rows, a) @ bent
    return ca.Function("show", [x, a, bent, v, S, C], [rows, H, up - g])
