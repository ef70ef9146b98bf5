"""Observers of users' own whose steps use elementary functions: an extended Kalman filter, and one that uses them all.

theta' = w,   J w' = T - b w - f tanh(w/w_0) - k sin(theta),   T' = 0        column with Coulomb friction and aligning torque
"""

import casadi as ca
import numpy as np

from codriver.observers import Observer, Output

DT, J, B, F, W0, K = 0.01, 0.05, 0.3, 0.8, 0.1, 2.0  # s, kg m^2, N m s/rad, N m, rad/s, N m
Q, R = np.diag([1e-8, 1e-4, 1e-2]), 1e-6
START = {"angle": 0.0, "rate": 0.0, "torque": 0.0}
PLACES = [(i, k) for i in range(3) for k in range(i, 3)]


def model(x):
    """One step of the column by Euler's method, as a column of three."""
    angle, rate, torque = x[0], x[1], x[2]
    turned = (torque - B * rate - F * ca.tanh(rate / W0) - K * ca.sin(angle)) / J
    return ca.vertcat(angle + DT * rate, rate + DT * turned, torque)


def predict():
    """x -> the model, and its derivative by CasADi."""
    x = ca.SX.sym("x", 3)
    return ca.Function("predict", [x], [model(x), ca.jacobian(model(x), x)])


def column_filter() -> Observer:
    """An extended Kalman filter of the hands' torque from the angle alone."""

    def step(carry, u, y, ok, rho):
        x = ca.vertcat(*(carry[name] for name in START))
        p = ca.SX(3, 3)
        for i, k in PLACES:
            p[i, k] = p[k, i] = carry[f"p{i}{k}"]
        x, a = predict()(x)
        p = a @ p @ a.T + Q
        s = p[0, 0] + R
        gain = ca.if_else(ok["steering_wheel_angle"], 1.0, 0.0) * p[:, 0] / s
        e = ca.if_else(ok["steering_wheel_angle"], y["steering_wheel_angle"] - x[0], 0.0)
        x = x + gain * e
        p = p - gain @ p[0, :]
        new = dict(zip(START, ca.vertsplit(x), strict=True)) | {f"p{i}{k}": p[i, k] for i, k in PLACES}
        return new, {"driver_torque": x[2], "driver_torque_sd": ca.sqrt(p[2, 2]), "steering_wheel_angle": x[0]}

    outputs = (
        Output("driver_torque", "N*m", "estimate"), Output("driver_torque_sd", "N*m", "sd"),
        Output("steering_wheel_angle", "rad", "estimate"),
    )  # fmt: skip
    start = START | {f"p{i}{k}": 1e-3 if i == k else 0.0 for i, k in PLACES}
    return Observer("column-filter", DT, (), ("steering_wheel_angle",), start, outputs, step)


def every_function() -> Observer:
    """Every elementary function of an angle a and a rate b, and of what is remembered; all well conditioned."""

    def step(carry, u, y, ok, rho):
        a = ca.if_else(ok["steering_wheel_angle"], u["steering_wheel_angle"], carry["held"])
        b = ca.if_else(ok["yaw_rate"], u["yaw_rate"], 0.1)
        unit, size = a / (1.0 + ca.fabs(a)), ca.fabs(a) + 0.5
        made = [
            ca.sin(a), ca.cos(a), ca.sin(100 * b), ca.tan(0.7 * unit), ca.asin(unit), ca.acos(unit), ca.atan(a * b),
            ca.atan2(a, b), ca.exp(-size), ca.expm1(0.1 * b), ca.log(size), ca.log1p(size), size**1.7, size**b,
            (a / 4.0) ** 3, size**-2, ca.sinh(unit), ca.cosh(unit), ca.tanh(b), ca.floor(3.0 * unit + 0.01),
            ca.ceil(3.0 * unit + 0.01), ca.sign(b), ca.copysign(a, b), ca.fmin(a, b), ca.fmax(a, b), ca.hypot(a, b),
            ca.if_else(a > b, ca.exp(unit), ca.log(size)), ca.sqrt(ca.fabs(ca.sin(b))),
            ca.cos(ca.fmod(a, 6.5)), ca.cos(ca.remainder(a, 6.5)),
        ]  # fmt: skip
        return {"held": a}, {f"made{k}": value for k, value in enumerate(made)}

    outputs = tuple(Output(f"made{k}", "", "estimate") for k in range(30))
    inputs = ("steering_wheel_angle", "yaw_rate")
    return Observer("every-function", DT, inputs, (), {"held": 0.0}, outputs, step)
