"""The estimators of a motorcycle's lean, tyre forces and rider's torque: the family `motorcycle`, in order of preference.

| name              | how                                                            | bands | bias  |
|-------------------|----------------------------------------------------------------|-------|-------|
| motorcycle-ekf    | extended Kalman filter at any lean, raw IMU                    | yes   | found |
| motorcycle-kalman | Kalman filter on the linear model, balanced turn               | yes   | no    |
| motorcycle-ts     | Takagi-Sugeno observer by LMI, differentiator, balanced turn   | no    | no    |
| motorcycle-uio    | unknown-input observer, differentiator, balanced turn          | no    | no    |
| bicycle-kalman    | Kalman filter on the Whipple bicycle, for vehicles with its parameters | yes | roll |
| motorcycle-imu    | roll alone, from gyroscope and speed; needs no vehicle         | yes   | roll  |

Signals are the IMU's, in body axes: roll_rate, pitch_rate and yaw_rate about the machine's own x, y and z, lateral_acceleration
and vertical_acceleration along its own y and z. heading_rate, an output, is about the road's normal. In front of motorcycle-ts and
motorcycle-uio measurements are turned into the road's frame (`road_frame`), and a differentiator makes the steer rate.

Damon, Ichalal, Arioui 2018, and what it compares itself with; Meijaard et al. 2007, doi:10.1098/rspa.2007.1857, for bicycles.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from codriver.errors import DesignError
from codriver.models.bicycle import LETTERS as BICYCLE_LETTERS
from codriver.models.bicycle import BicycleParameters
from codriver.models.lpv import LPV
from codriver.models.motorcycle import LETTERS, MotorcycleParameters, motorcycle_model
from codriver.models.motorcycle_lean import LeanParameters
from codriver.observers.bicycle_kalman import NEEDED as BICYCLE_NEEDED
from codriver.observers.bicycle_kalman import BicycleNoise, bicycle_kalman
from codriver.observers.differentiator import algebraic_differentiator
from codriver.observers.motorcycle_ekf import NEEDED, motorcycle_ekf
from codriver.observers.motorcycle_ekf_states import EkfNoise
from codriver.observers.motorcycle_imu import crown_correction, motorcycle_imu
from codriver.observers.motorcycle_kalman import motorcycle_kalman
from codriver.observers.motorcycle_lmi import MotorcycleLMI, design_motorcycle_lmi
from codriver.observers.motorcycle_ts import motorcycle_ts_observer
from codriver.observers.motorcycle_uio import design_motorcycle_uio, motorcycle_uio
from codriver.observers.observer import Observer, Scalars, chain
from codriver.observers.registry import Design, Estimator, register
from codriver.observers.road_frame import road_frame_observer
from codriver.observers.steer_zero import SteerZero, without_zero
from codriver.vehicles import Vehicle

FAMILY = "motorcycle"
PARAMETERS = tuple(LETTERS.values())
BALANCED = ("steer_angle", "roll_rate", "yaw_rate", "longitudinal_speed")
CHAINED = ("longitudinal_speed", "yaw_rate", "steer_angle", "roll_rate")  # the same, as the parts of a chain want them
RANGE = (8.0, 45.0)  # m/s, of the observers by LMI and of the unknown input
RATE = (
    100.0  # Hz, at which errors of the balanced turn are independent, however often it is sampled; and that tyres need
)
WINDOW = 0.04  # s, of the differentiator in front of them
# Of the design by LMI: a = v W errs by all that is out of balance, far more than a gyroscope does; with less trust in it and slow
# poles the roll comes from the rates. The tyres' own poles v / sigma bound the disc from below: the narrowest that can be is taken.
UNBALANCED, SLOWEST, DISCS = 0.7, 0.1, (160.0, 200.0, 250.0, 300.0)  # m/s^2, 1/s, rad/s


def _ekf(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    noise = EkfNoise(zero=SteerZero.from_vehicle(vehicle).sd)
    return _of(vehicle, motorcycle_ekf(LeanParameters.from_vehicle(vehicle), design.dt, noise=noise))


def _kalman(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    model = motorcycle_model(MotorcycleParameters.from_vehicle(vehicle)).with_walking_inputs()
    return _of(vehicle, motorcycle_kalman(model, design.dt, form="constant" if design.form == "constant" else "kalman"))


def _ts(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    model = motorcycle_model(MotorcycleParameters.from_vehicle(vehicle)).with_walking_inputs()
    return _of(vehicle, on_the_road(motorcycle_ts_observer(design_for_balance(model, design.dt))))


def design_for_balance(model: LPV, dt: float) -> MotorcycleLMI:
    """Gains by LMI for a lateral acceleration that is made of speed and yaw rate.

    Args:
        model: `motorcycle_model(p).with_walking_inputs()`.
        dt: tick, s.

    Raises:
        DesignError: no such observer, in the widest region either.
        UsageError: cvxpy is not installed.
    """

    def within(fastest: float) -> MotorcycleLMI:
        return design_motorcycle_lmi(
            model, *RANGE, dt, slowest=SLOWEST, fastest=fastest, rate=min(RATE, 1 / dt),
            sensors={"lateral_acceleration": UNBALANCED},
        )  # fmt: skip

    for fastest in DISCS[:-1]:
        with suppress(DesignError):
            return within(fastest)
    return within(DISCS[-1])


def _uio(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    made = design_motorcycle_uio(motorcycle_model(MotorcycleParameters.from_vehicle(vehicle)), *RANGE, design.dt)
    return _of(vehicle, on_the_road(motorcycle_uio(made, design.dt)))


def _bicycle(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    friction = vehicle.number("steer_friction") if "steer_friction" in vehicle else 0.0
    sd = SteerZero.from_vehicle(vehicle).sd
    noise = BicycleNoise(offset_start=sd) if sd else BicycleNoise()
    return _of(
        vehicle, bicycle_kalman(BicycleParameters.from_vehicle(vehicle), design.dt, friction=friction, noise=noise)
    )


def _imu(vehicle: Vehicle | None, design: Design) -> Observer:
    if vehicle is None or any(name not in vehicle for name in PARAMETERS):
        return motorcycle_imu(design.dt)
    return _of(vehicle, motorcycle_imu(design.dt, crown_correction(LeanParameters.from_vehicle(vehicle))))


def _of(vehicle: Vehicle, observer: Observer) -> Observer:
    straight = without_zero(observer, SteerZero.from_vehicle(vehicle))
    return replace(straight, settings={"vehicle": vehicle.name, **straight.settings})


def on_the_road(observer: Observer) -> Observer:
    """An observer of the road's frame behind what makes its measurements of an IMU's, an encoder's and a speed.

    Its yaw_rate is heading_rate outside, since yaw_rate there is the IMU's.

    Args:
        observer: takes steer_rate, yaw_rate and lateral_acceleration of the road as inputs.
    """
    window = max(round(WINDOW / observer.dt), 1) * observer.dt
    front = chain(road_frame_observer(observer.dt), algebraic_differentiator(observer.dt, window))
    whole = chain(front, observer, observer.name)
    made = {"yaw_rate": "heading_rate"}
    inner = {output.name for output in front.outputs} - {output.name for output in observer.outputs}

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new, out = whole.step(carry, u, y, ok, rho)
        return new, {made.get(name, name): value for name, value in out.items() if name not in inner}

    outputs = tuple(
        replace(o, name="heading_rate", meaning="rotation about the road's normal, positive to the left")
        if o.name in made
        else o
        for o in whole.outputs
        if o.name not in inner
    )
    return replace(whole, outputs=outputs, step=step)


register(Estimator(
    "motorcycle-ekf", PARAMETERS, NEEDED,
    "roll, tyre forces and rider's torque at any lean, from the IMU's raw signals, steer angle and speed; finds biases", FAMILY,
    _ekf, forms=("kalman",), least=RATE, varies=False,
))  # fmt: skip
register(Estimator(
    "motorcycle-kalman", PARAMETERS, BALANCED,
    "roll, tyre forces and rider's torque on the linear model, from steer angle, gyroscope and speed", FAMILY, _kalman,
    least=RATE, varies=False,
))  # fmt: skip
register(Estimator(
    "motorcycle-ts", PARAMETERS, CHAINED,
    "roll, tyre forces and rider's torque by the 2018 paper's observer, no bands", FAMILY, _ts, forms=("kalman",), least=RATE,
    varies=False,
))  # fmt: skip
register(Estimator(
    "motorcycle-uio", PARAMETERS, CHAINED,
    "roll, tyre forces and rider's torque by an unknown-input observer, no bands", FAMILY, _uio, forms=("kalman",), least=RATE,
    varies=False,
))  # fmt: skip
register(Estimator(
    "bicycle-kalman", tuple(BICYCLE_LETTERS.values()), (*BICYCLE_NEEDED, "longitudinal_speed"),
    "roll and rider's torque of a bicycle, from steer angle, roll rate and speed; yaw rate if there", FAMILY, _bicycle,
    forms=("kalman",), varies=False,
))  # fmt: skip
register(Estimator(
    "motorcycle-imu", (), (*BALANCED[1:],), "roll alone from gyroscope and speed, the usual baseline", FAMILY, _imu,
    forms=("kalman",), varies=False,
))  # fmt: skip
