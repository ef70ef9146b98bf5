"""Parameters of the simulated car.

The numbers are those of the 2017 paper where it gives them. They belong to the simulator: an estimator gets its own from a
vehicle file, and may be wrong about them.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CarParameters:
    """A car with robotised gearbox.

    Attributes:
        mass: M, kg; the inertia of wheels and engine is counted in.
        transmission: tau by gear, wheel force per engine torque, 1/m.
        brake: c_b, N/Pa.
        pedal: c_r, torque request at the full pedal, N m.
        rolling: kappa_1, N.
        drag: kappa_2, kg/m.
        efficiency: of gearbox and driveline; the engine turns at v tau / efficiency.
        engine_lag: time constant of the engine's torque, s.
        engine_inertia: of the engine up to the clutch, kg m^2.
        friction: engine drag torque at rest, N m.
        friction_slope: its growth with engine speed, N m s.
        idle: idle speed, rad/s.
        cut, open_time, close: lengths of the phases of a gear shift, s: torque cut, clutch open, clutch closing.
        wheelbase, steering_ratio, understeer: of the steering wheel angle sent on the bus, m, 1, rad s^2/m.
    """

    mass: float = 1550.0
    transmission: tuple[float, ...] = (41.0, 22.0, 14.0, 10.0, 8.0)
    brake: float = 189e-5
    pedal: float = 325.0
    rolling: float = 131.0
    drag: float = 0.283
    efficiency: float = 0.93
    engine_lag: float = 0.08
    engine_inertia: float = 0.14
    friction: float = 10.0
    friction_slope: float = 0.06
    idle: float = 85.0
    cut: float = 0.16
    open_time: float = 0.3
    close: float = 0.38
    wheelbase: float = 2.6
    steering_ratio: float = 15.5
    understeer: float = 0.002


# The car of the 2015 paper. Its section V prints tau = 13, 6.9, 4.3, 3.1, 2.5, and equation 2 says that tau holds 1/r_r. But
# they are those of the 2017 car, 41, 22, 14, 10, 8 1/m, times a rolling radius of 0.307 to 0.317 m, gear by gear: 1/r_r
# looks to be left out. Taken as 1/m, an engine at idle would drive the car at 22 km/h in first gear and at 114 km/h in
# fifth; so the car simulated here has printed / r_r. The rest is the 2017 car's.
PRINTED_2015 = (13.0, 6.9, 4.3, 3.1, 2.5)
ROLLING_RADIUS_2015 = 0.313  # m, the mean of the five quotients
CAR_2015 = CarParameters(mass=1500.0, transmission=tuple(tau / ROLLING_RADIUS_2015 for tau in PRINTED_2015))
