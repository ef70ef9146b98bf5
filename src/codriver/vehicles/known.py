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

# Two-wheelers. Letters with a small index are Sharp's (codriver.models.motorcycle), others Meijaard's (codriver.models.bicycle).
_TWO_WHEELER: dict[str, Known] = {
    "steer_axis_tilt": Known("rad", 0, 1.2, False, "eps or lambda, tilt of a two-wheeler's steer axis"),
    "normal_trail": Known("m", -0.2, 0.5, False, "t, of the front contact from the steer axis, across the axis"),
    "trail": Known("m", -0.2, 0.5, False, "c, of the front contact behind the steer axis, along the road"),
    "front_wheel_radius": Known("m", 0.05, 1, False, "R_f, r_F"),
    "rear_wheel_radius": Known("m", 0.05, 1, False, "R_r, r_R"),
    "front_wheel_spin_inertia": Known("kg*m^2", 0, 10, False, "i_fy, I_Fyy, of the front wheel about its axle"),
    "rear_wheel_spin_inertia": Known(
        "kg*m^2", 0, 10, False, "i_ry, I_Ryy, of the rear wheel and all that turns with it"
    ),
    "front_frame_mass": Known("kg", 0.1, 500, False, "M_f, of all that steers, front wheel included"),
    "rear_frame_mass": Known("kg", 1, 2000, False, "M_r, of the rest, rear wheel and rider included"),
    "rear_frame_roll_inertia": Known("kg*m^2", 0, 500, False, "I_rx, of the rear frame about its mass centre"),
    "rear_frame_yaw_inertia": Known("kg*m^2", 0, 500, False, "I_rz, of the rear frame about its mass centre"),
    "rear_frame_product_of_inertia": Known("kg*m^2", -200, 200, False, "C_rxz, integral of x z dm, z downwards"),
    "front_frame_roll_inertia": Known("kg*m^2", 0, 100, False, "I_fx, of the front frame, across the steer axis"),
    "front_frame_steer_inertia": Known("kg*m^2", 0, 100, False, "I_fz, of the front frame, along the steer axis"),
    "steer_axis_distance": Known(
        "m", 0, 5, False, "a, of the steer axis from the road point below the rear frame's mass centre, across the axis"
    ),
    "rear_axle_distance": Known("m", 0, 5, False, "b, of the rear contact from that point"),
    "front_frame_forward": Known("m", -1, 1, False, "e, of the front frame's mass centre in front of the steer axis"),
    "front_frame_along": Known(
        "m", -1, 1, False, "f, height of the front frame's mass centre along the steer axis, over the foot of a"
    ),
    "rear_frame_height": Known("m", 0, 3, False, "h, of the rear frame's mass centre"),
    "front_camber_stiffness": Known("N/rad", -1e5, 1e5, False, "C_f2, lateral force of the front tyre per camber"),
    "rear_camber_stiffness": Known("N/rad", -1e5, 1e5, False, "C_r2, lateral force of the rear tyre per camber"),
    "front_relaxation_length": Known("m", 1e-3, 5, False, "sigma_f, over which the front tyre builds up its force"),
    "rear_relaxation_length": Known("m", 1e-3, 5, False, "sigma_r, over which the rear tyre builds up its force"),
    "steer_damping": Known("N*m*s/rad", 0, 100, False, "K, of a two-wheeler's steering damper"),
    "steer_friction": Known("N*m", 0, 20, False, "T_c, Coulomb friction of a two-wheeler's steer axis; 0"),
    "steer_zero": Known(
        "rad",
        -0.35,
        0.35,
        False,
        "delta_0, what a two-wheeler's steering encoder shows straight ahead (motorcycle.md); 0",
    ),
    "front_wheel_load": Known("N", 0, 2e4, False, "-Z_f, static load of the front wheel"),
    "front_crown_radius": Known("m", 0, 0.2, False, "rho_f, of the front tyre's round section (Cossalter 2006); 0.05"),
    "rear_crown_radius": Known("m", 0, 0.3, False, "rho_r, of the rear tyre's round section; 0.09"),
    "pneumatic_trail": Known("m", 0, 0.2, False, "t_p, of both tyres' lateral force behind the contact; 0.02"),
    "imu_forward": Known(
        "m", -2, 3, False, "X of the IMU, ahead of the road point below the rear frame's mass centre; 0"
    ),
    "imu_left": Known("m", -1, 1, False, "n of the IMU, to the left of the frame's plane; 0"),
    "imu_height": Known("m", 0, 2, False, "Z of the IMU, above the road when upright; 0.8"),
    "rear_wheel_mass": Known("kg", 0, 200, False, "m_R"),
    "rear_wheel_inertia": Known("kg*m^2", 0, 10, False, "I_Rxx, of the rear wheel about a diameter"),
    "frame_forward": Known("m", -1, 5, False, "x_B, of frame and rider's mass centre in front of the rear contact"),
    "frame_height": Known("m", 0, 3, False, "-z_B, of frame and rider's mass centre"),
    "frame_mass": Known("kg", 0.1, 2000, False, "m_B, of frame and rider without wheels and fork"),
    "frame_roll_inertia": Known("kg*m^2", 0, 500, False, "I_Bxx, about its mass centre"),
    "frame_product_of_inertia": Known("kg*m^2", -200, 200, False, "I_Bxz, minus the integral of x z dm, z downwards"),
    "frame_yaw_inertia": Known("kg*m^2", 0, 500, False, "I_Bzz, about its mass centre"),
    "fork_forward": Known("m", -1, 5, False, "x_H, of fork and handlebar's mass centre in front of the rear contact"),
    "fork_height": Known("m", 0, 3, False, "-z_H, of fork and handlebar's mass centre"),
    "fork_mass": Known("kg", 0.01, 200, False, "m_H, of fork and handlebar without the wheel"),
    "fork_roll_inertia": Known("kg*m^2", 0, 100, False, "I_Hxx, about its mass centre"),
    "fork_product_of_inertia": Known("kg*m^2", -20, 20, False, "I_Hxz, minus the integral of x z dm, z downwards"),
    "fork_yaw_inertia": Known("kg*m^2", 0, 100, False, "I_Hzz, about its mass centre"),
    "front_wheel_mass": Known("kg", 0, 200, False, "m_F"),
    "front_wheel_inertia": Known("kg*m^2", 0, 10, False, "I_Fxx, of the front wheel about a diameter"),
}
KNOWN |= _TWO_WHEELER
