"""The parameters that a vehicle can have, their units and bounds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Known:
    """A parameter that a vehicle file may hold: SI unit, plausible bounds, whether one value per gear, and its meaning."""

    unit: str
    low: float
    high: float
    per_gear: bool
    meaning: str


KNOWN: dict[str, Known] = {
    "mass": Known("kg", 50, 60000, False, "M, total mass as driven"),
    "transmission": Known(
        "1/m", 0.1, 500, True, "tau, wheel force per engine torque, one value per forward gear (2017 eq. 1b)"
    ),
    "transmission_reverse": Known("1/m", 0.1, 500, False, "tau of the reverse gear, as a positive number"),
    "brake_coefficient": Known("N/Pa", 1e-5, 1, False, "c_b, brake force per brake pressure (2017 eq. 8a)"),
    "pedal_coefficient": Known("N*m", 1, 5000, False, "c_r, torque request at the fully pressed pedal (2017 eq. 8b)"),
    "rolling_resistance": Known("N", 0, 20000, False, "kappa_1 = C_r M g (2017 eq. 19)"),
    "drag": Known("kg/m", 0, 20, False, "kappa_2 = rho S C_x / 2 (2017 eq. 19)"),
    "brake_threshold": Known(
        "Pa", 0, 2e6, False, "brake pressure above which the driver is braking (sigma of 2017 eq. 4)"
    ),
    "steering_inertia": Known("kg*m^2", 1e-4, 10, False, "J_s, of the steering wheel and its column (2019 eq. 27)"),
    "steering_damping": Known("N*m*s/rad", 0, 50, False, "b_s, of the steering wheel and its column (2019 eq. 27)"),
    "steering_friction": Known("N*m", 0, 50, False, "T_c, Coulomb friction of the steering column"),
    "steering_presliding": Known(
        "rad", 1e-5, 1, False, "d, angle within which the friction of the steering column turns round"
    ),
    "steering_end_stop": Known("rad", 0.05, 40, False, "angle of the steering wheel at its end stops, to either side"),
    "torque_scale": Known(
        "N*m", -1e5, 1e5, False, "torque of the steering motor per unit of its command (2019 eq. 89)"
    ),
    "torque_offset": Known("N*m", -100, 100, False, "torque of the steering motor at command 0 (2019 eq. 89)"),
}
