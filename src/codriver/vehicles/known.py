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
    "steering_end_stop": Known("rad", 0.05, 40, False, "angle of the steering wheel at its end stops, to either side"),
    "torque_scale": Known(
        "N*m", -1e5, 1e5, False, "torque of the steering motor per unit of its command (2019 eq. 89)"
    ),
    "torque_offset": Known("N*m", -100, 100, False, "torque of the steering motor at command 0 (2019 eq. 89)"),
    "steering_ratio": Known("1", 1, 100, False, "i, angle of the steering wheel per steer angle of the front wheels"),
    "wheelbase": Known("m", 0.5, 12, False, "L, distance of the axles"),
    "characteristic_speed": Known(
        "m/s", 5, 1000, False, "v_ch, where a steady turn has half the yaw rate of a car without slip"
    ),
    "front_axle_distance": Known("m", 0.1, 10, False, "l_f, of the front axle from the centre of mass (2019 eq. 92)"),
    "yaw_inertia": Known("kg*m^2", 10, 1e6, False, "I_z, about the vertical axis through the centre of mass"),
    "front_cornering_stiffness": Known("N/rad", 1e3, 2e6, False, "C_f, lateral force of the front axle per slip angle"),
    "rear_cornering_stiffness": Known("N/rad", 1e3, 2e6, False, "C_r, lateral force of the rear axle per slip angle"),
    "alignment_stiffness": Known(
        "N*m/rad", 0, 1e5, False, "K_aln, positive: i times torque on the column per front slip angle (2019 eq. 92)"
    ),
    "alignment_gain": Known(
        "kg*m", 0, 50, False, "k_a, torque on the column per lateral acceleration, for small ones (alignment.md)"
    ),
    "alignment_bend": Known(
        "N*m", 0.01, 1e3, False, "T_s, torque from which on the assist takes its share (alignment.md)"
    ),
    "alignment_offset": Known(
        "N*m", -10, 10, False, "T_0, driver's torque that holds the wheel at the angle 0 (alignment.md)"
    ),
    "alignment_whole": Known(
        "1",
        1,
        1,
        False,
        "there, and 1, where the alignment map is the whole load on the column and no assist's share is taken off",
    ),
    "alignment_torque_sd": Known("N*m", 0, 50, False, "standard deviation of what the alignment map leaves out"),
    "alignment_torque_time": Known("s", 0, 1e3, False, "correlation time of what the alignment map leaves out"),
    "steering_friction_width": Known("rad", 1e-5, 1, False, "w, angle over which the column's friction builds up"),
    "road_bank": Known("rad", 0, 0.3, False, "e_max, greatest bank of the roads in curves (alignment.md)"),
    "road_bank_share": Known(
        "1", 0, 2, False, "q, share of the lateral acceleration at the road's speed that its bank takes over"
    ),
}
