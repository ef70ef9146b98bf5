"""The vocabulary: standard signal names, their units, symbols and sign conventions.

A standard name means one quantity, in one unit, with one sign, wherever it appears: in a log, in an observer's inputs, in
the exported C. Axes are ISO 8855 (x forward, y left, z up). Units inside are SI and radians; `display` is the unit in
which people of the field read the quantity, and is used by reports alone.

`low`, `high` bound what a road vehicle can plausibly show. They clip nothing: a log outside them gets a warning that
its unit or its scale is probably wrong; a few odd values outside them are codes for "not valid" to the readers. `hold`
is how long, in seconds, the last value of a signal may stand in for a missing one before it counts as stale; quantities
sent on change only (gear, switches) are held without limit.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, pi

from codriver.errors import UsageError


@dataclass(frozen=True)
class Quantity:
    """One entry of the vocabulary.

    Attributes:
        name: the standard name.
        unit: SI unit, as pint writes it; "1" for pure numbers.
        display: the unit shown to people.
        symbol: the papers' letter.
        meaning: what it is, with its sign.
        low, high: plausible range in `unit`.
        hold: seconds for which the last value may be held.
    """

    name: str
    unit: str
    display: str
    symbol: str
    meaning: str
    low: float = -inf
    high: float = inf
    hold: float = 0.5


_ENTRIES = (
    # what the vehicle does
    Quantity("longitudinal_speed", "m/s", "km/h", "v", "speed over ground along x; negative in reverse", -20, 110),
    Quantity(
        "longitudinal_acceleration",
        "m/s^2",
        "m/s^2",
        "y1",
        "what an accelerometer along x shows: dv/dt + g sin(slope) + bias; positive when speeding up",
        -20,
        20,
    ),
    Quantity("longitudinal_jerk", "m/s^3", "m/s^3", "j", "time derivative of the vehicle's acceleration along x"),
    Quantity("lateral_velocity", "m/s", "m/s", "vy", "velocity along y, positive to the left", -30, 30),
    Quantity("lateral_acceleration", "m/s^2", "m/s^2", "ay", "acceleration along y, positive to the left", -30, 30),
    Quantity("vertical_acceleration", "m/s^2", "m/s^2", "az", "specific force along z, +9.81 at rest", -60, 60),
    Quantity("sideslip_angle", "rad", "deg", "beta", "atan(vy/vx)", -pi, pi),
    Quantity("yaw_rate", "rad/s", "deg/s", "r", "rotation about z, positive to the left", -7, 7),
    Quantity(
        "heading_rate",
        "rad/s",
        "deg/s",
        "W",
        "rotation about the road's normal, positive to the left; yaw_rate where nothing leans",
        -7,
        7,
    ),
    Quantity("roll_rate", "rad/s", "deg/s", "p", "rotation about x, positive when the right side goes down", -7, 7),
    Quantity("pitch_rate", "rad/s", "deg/s", "q", "rotation about y, positive when the nose goes down", -7, 7),
    Quantity(
        "roll_angle",
        "rad",
        "deg",
        "phi",
        "positive when leaning to the right; what is estimated is from the vertical",
        -pi / 2,
        pi / 2,
    ),
    Quantity("roll_acceleration", "rad/s^2", "rad/s^2", "p'", "time derivative of roll_rate"),
    Quantity("pitch_angle", "rad", "deg", "theta", "positive when the nose is down", -pi / 2, pi / 2),
    Quantity("distance", "m", "m", "s", "distance travelled, the papers' curvilinear coordinate", -1e3, 1e7),
    Quantity("latitude", "deg", "deg", "lat", "north positive", -90, 90),
    Quantity("longitude", "deg", "deg", "lon", "east positive", -180, 180),
    Quantity("altitude", "m", "m", "h", "height above sea level", -500, 9000),
    Quantity("pitching", "rad/s", "deg/s", "theta'", "pitch rate of a leaning machine beside that of its turn", -3, 3),
    # what the person does
    Quantity(
        "accelerator_pedal", "1", "%", "p_r", "accelerator pedal position, 0 released to 1 fully pressed", -0.02, 1.02
    ),
    Quantity("brake_pressure", "Pa", "bar", "p_b", "brake master-cylinder pressure, gauge", -5e5, 3e7),
    Quantity("brake_switch", "1", "1", "sigma", "1 while the brake pedal is pressed", 0, 1, inf),
    Quantity("steering_wheel_angle", "rad", "deg", "delta_s", "positive to the left", -20, 20),
    Quantity("steering_wheel_rate", "rad/s", "deg/s", "omega_s", "positive to the left", -40, 40),
    Quantity(
        "steering_wheel_torque", "N*m", "N*m", "T_s", "torque in the steering column, positive to the left", -100, 100
    ),
    Quantity(
        "steering_motor_torque",
        "N*m",
        "N*m",
        "T_m",
        "torque of the force-feedback or assist motor on the steering column, positive to the left",
        -100,
        100,
    ),
    Quantity(
        "steering_motor_command",
        "1",
        "1",
        "T_com",
        "what that motor is told, in the device's own unit; torque = torque_scale times it + torque_offset",
    ),
    Quantity("steer_angle", "rad", "deg", "delta", "angle of the steered wheel or fork, positive to the left", -pi, pi),
    Quantity("steer_rate", "rad/s", "deg/s", "omega", "rate of the steered wheel or fork", -40, 40),
    Quantity(
        "driver_torque",
        "N*m",
        "N*m",
        "T_dr",
        "torque of the driver's hands on the wheel, positive to the left",
        -100,
        100,
    ),
    Quantity(
        "hands_on", "1", "%", "p_h", "probability that the driver's hands are on the wheel; as truth 0 or 1", 0, 1
    ),
    Quantity(
        "rider_torque",
        "N*m",
        "N*m",
        "T_r",
        "torque of the rider's hands on the handlebar, positive to the left",
        -300,
        300,
    ),
    Quantity(
        "roll_moment",
        "N*m",
        "N*m",
        "T_phi",
        "moment from outside about the line where a bicycle's wheels touch the road, positive when it leans it to the right",
        -2000,
        2000,
    ),
    Quantity(
        "rider_lean",
        "rad",
        "deg",
        "lambda",
        "of the rider's upper body beside the machine, positive to the right",
        -pi / 2,
        pi / 2,
    ),
    Quantity(
        "alignment_torque",
        "N*m",
        "N*m",
        "T_aln",
        "torque of the tyres on the steering column, positive to the left",
        -300,
        300,
    ),
    Quantity(
        "column_torque",
        "N*m",
        "N*m",
        "T_k",
        "all torques on the steering column but the driver's, friction included",
        -300,
        300,
    ),
    Quantity("front_lateral_force", "N", "N", "Y_f", "lateral force of the front tyres, positive to the left"),
    Quantity("rear_lateral_force", "N", "N", "Y_r", "lateral force of the rear tyres, positive to the left"),
    # what the powertrain does
    Quantity("engine_torque", "N*m", "N*m", "T_e", "torque the engine or motor actually gives", -1500, 3000),
    Quantity("engine_torque_request", "N*m", "N*m", "T_r", "torque the driver requests by the pedal", -1500, 3000),
    Quantity("engine_speed", "rad/s", "rpm", "omega_e", "rotation of the engine or motor", -50, 2500),
    Quantity("gear", "1", "1", "gear", "engaged gear: 1, 2, ...; 0 neutral; -1 reverse", -1, 12, inf),
    Quantity("clutch", "1", "1", "clutch", "0 closed (torque passes) to 1 open (no torque passes)", 0, 1, inf),
    # the road
    Quantity("road_slope", "rad", "%", "alpha", "positive uphill", -0.6, 0.6),
    Quantity("road_bank", "rad", "deg", "beta_r", "tilt across, positive when the right side is lower", -0.6, 0.6),
    Quantity("road_curvature", "1/m", "1/m", "rho", "positive to the left", -1, 1),
    Quantity("lateral_offset", "m", "m", "y", "of the centre of mass from the path, positive to the left", -20, 20),
    Quantity(
        "heading_error", "rad", "deg", "psi", "heading of the car minus that of the path, positive to the left", -pi, pi
    ),
    Quantity(
        "near_angle", "rad", "deg", "theta_near", "direction of the path's near point, seen from the car", -pi, pi
    ),
    Quantity("far_angle", "rad", "deg", "theta_far", "direction of the path's far point, seen from the car", -pi, pi),
    # what codriver estimates
    Quantity("intentional_acceleration", "m/s^2", "m/s^2", "a_i", "acceleration the driver asks for"),
    Quantity("intentional_jerk", "m/s^3", "m/s^3", "j_i", "time derivative of the acceleration the driver asks for"),
    Quantity("acceleration_offset", "m/s^2", "m/s^2", "o_a", "accelerometer offset: g sin(slope) + bias"),
    Quantity("planned_acceleration", "m/s^2", "m/s^2", "a_p", "acceleration a simulated driver planned (truth)"),
    Quantity("planned_jerk", "m/s^3", "m/s^3", "j_p", "time derivative of planned_acceleration (truth)"),
    Quantity("driver_torque_ahead", "N*m", "N*m", "T_dr", "torque a driver model foretells"),
    Quantity("known_input", "m/s^2", "m/s^2", "u", "what the powertrain adds to the driver's intention"),
)

AHEAD = 20  # places ahead at which the road's curvature has a name
_ROAD_AHEAD = tuple(
    Quantity(
        f"road_curvature_ahead_{k}",
        "1/m",
        "1/m",
        f"rho_{k}",
        f"at the place reached in {k} of a driver model's steps",
        -1,
        1,
    )
    for k in range(1, AHEAD + 1)
)

VOCABULARY: dict[str, Quantity] = {entry.name: entry for entry in (*_ENTRIES, *_ROAD_AHEAD)}


def quantity(name: str) -> Quantity:
    """The vocabulary's entry for a standard name.

    Raises:
        UsageError: the name is not in the vocabulary; the message names the nearest ones.
    """
    try:
        return VOCABULARY[name]
    except KeyError:
        near = nearest(name, VOCABULARY)
        raise UsageError(
            f"'{name}' is not a standard signal name",
            "one of the names in codriver.names.VOCABULARY" + (f", perhaps {near}" if near else ""),
            "see docs/names.md for the list",
        ) from None


def nearest(name: str, among: Iterable[str]) -> str:
    """The names most like `name`, as text for an error message; empty if none is alike."""
    from difflib import get_close_matches

    return " or ".join(f"'{other}'" for other in get_close_matches(name, list(among), n=3, cutoff=0.5))
