"""The joint filters of the steering wheel in plain C, as one writes them by hand.

Sparsity is used where one sees it: F = J_z moves two rows, H picks the angle, the covariance is symmetric, Cholesky's factor
is triangular. Weights of the sigma points add up to 1, so H needs no points of its own. Neither start nor holes are
handled beyond a missing angle or torque, and nothing but the four estimates is written.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import plain_c

from codriver.identify.steering_joint import JointSettings
from codriver.identify.steering_ukf import Weights

_LOOP = """
#include <math.h>

static const double dt = %(dt)s, R = %(R)s, Q[4] = %(Q)s, start[4] = %(z)s, variance[4] = %(P)s;
%(constants)s
/* z = (angle, rate, J, b); columns: torque, angle. P is kept above its diagonal. */
void run(long n, double **in, unsigned char **ok, double **out)
{
    const double *restrict torque = in[0], *restrict angle = in[1];
    const unsigned char *restrict has_torque = ok[0], *restrict has_angle = ok[1];
    double *restrict o0 = out[0], *restrict o1 = out[1], *restrict o2 = out[2], *restrict o3 = out[3];
    double z[4], P[4][4] = { { 0.0 } }, T = 0.0;
    for (int i = 0; i < 4; ++i) {
        z[i] = start[i];
        P[i][i] = variance[i];
    }
    for (long k = 0; k < n; ++k) {
        if (k > 0) {%(move)s
        }
        if (has_angle[k]) {
            double K[4], s = P[0][0] + R, e = angle[k] - z[0];
            for (int i = 0; i < 4; ++i)
                K[i] = P[0][i] / s;
            for (int i = 3; i >= 0; --i)
                for (int j = 3; j >= i; --j)
                    P[i][j] -= K[i] * P[0][j];
            for (int i = 0; i < 4; ++i)
                z[i] += K[i] * e;
        }
        if (has_torque[k])
            T = torque[k];
        o0[k] = z[0]; o1[k] = z[1]; o2[k] = z[2]; o3[k] = z[3];
    }
}
"""

_EKF_MOVE = """
            double rate = z[1], J = z[2], b = z[3];
            double pull = (T - b * rate) / J;
            double f1 = 1.0 - dt * b / J, f2 = -dt * pull / J, f3 = -dt * rate / J;
            double p0[4], p1[4];
            p0[0] = P[0][0] + dt * P[0][1];
            p0[1] = P[0][1] + dt * P[1][1];
            p0[2] = P[0][2] + dt * P[1][2];
            p0[3] = P[0][3] + dt * P[1][3];
            p1[1] = f1 * P[1][1] + f2 * P[1][2] + f3 * P[1][3];
            p1[2] = f1 * P[1][2] + f2 * P[2][2] + f3 * P[2][3];
            p1[3] = f1 * P[1][3] + f2 * P[2][3] + f3 * P[3][3];
            P[0][0] = p0[0] + dt * p0[1] + Q[0];
            P[0][1] = f1 * p0[1] + f2 * p0[2] + f3 * p0[3];
            P[0][2] = p0[2];
            P[0][3] = p0[3];
            P[1][1] = f1 * p1[1] + f2 * p1[2] + f3 * p1[3] + Q[1];
            P[1][2] = p1[2];
            P[1][3] = p1[3];
            P[2][2] += Q[2];
            P[3][3] += Q[3];
            z[0] += dt * rate;
            z[1] += dt * pull;"""

_UKF_MOVE = """
            double L[4][4], X[9][4], mean[4];
            for (int j = 0; j < 4; ++j) {
                double d = P[j][j];
                for (int m = 0; m < j; ++m)
                    d -= L[j][m] * L[j][m];
                L[j][j] = sqrt(d);
                for (int i = j + 1; i < 4; ++i) {
                    double v = P[j][i];
                    for (int m = 0; m < j; ++m)
                        v -= L[i][m] * L[j][m];
                    L[i][j] = v / L[j][j];
                }
            }
            for (int i = 0; i < 4; ++i) {
                X[0][i] = z[i];
                for (int j = 0; j < 4; ++j) {
                    double step = j <= i ? spread * L[i][j] : 0.0;
                    X[1 + j][i] = z[i] + step;
                    X[5 + j][i] = z[i] - step;
                }
            }
            for (int p = 0; p < 9; ++p) {
                double rate = X[p][1];
                X[p][0] += dt * rate;
                X[p][1] += dt * (T - X[p][3] * rate) / X[p][2];
            }
            for (int i = 0; i < 4; ++i) {
                double sum = 0.0;
                for (int p = 1; p < 9; ++p)
                    sum += X[p][i];
                mean[i] = mean_0 * X[0][i] + other * sum;
            }
            for (int p = 0; p < 9; ++p)
                for (int i = 0; i < 4; ++i)
                    X[p][i] -= mean[i];
            for (int i = 0; i < 4; ++i)
                for (int j = i; j < 4; ++j) {
                    double sum = 0.0;
                    for (int p = 1; p < 9; ++p)
                        sum += X[p][i] * X[p][j];
                    P[i][j] = covariance_0 * X[0][i] * X[0][j] + other * sum + (i == j ? Q[i] : 0.0);
                }
            for (int i = 0; i < 4; ++i)
                z[i] = mean[i];"""


def ekf(settings: JointSettings, folder: Path, flags: Sequence[str] = plain_c.FLAGS) -> Callable[..., None]:
    """The extended filter: run(n, columns, flags, outputs), lists of arrays."""
    return plain_c.loop(_text(settings, "", _EKF_MOVE), folder, "ekf", flags)


def ukf(
    settings: JointSettings, weights: Weights, folder: Path, flags: Sequence[str] = plain_c.FLAGS
) -> Callable[..., None]:
    """The unscented filter, likewise."""
    w = weights
    numbers = {"spread": w.spread, "mean_0": w.mean, "covariance_0": w.covariance, "other": w.other}
    constants = ", ".join(f"{name} = {value.hex()}" for name, value in numbers.items())
    return plain_c.loop(_text(settings, f"static const double {constants};", _UKF_MOVE), folder, "ukf", flags)


def _text(settings: JointSettings, constants: str, move: str) -> str:
    """The whole file."""
    z = (*settings.start, *settings.guess)
    lists = {"Q": settings.process, "z": z, "P": settings.start_variance}
    numbers = {name: "{ " + ", ".join(float(x).hex() for x in values) + " }" for name, values in lists.items()}
    return _LOOP % {"dt": settings.dt.hex(), "R": settings.angle.hex(), "constants": constants, "move": move, **numbers}
