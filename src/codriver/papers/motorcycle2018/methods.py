"""The observers that stand in the tables, each compiled once: the paper's, its variants, and what there is beside it.

All but the IMU's know the machine as `nominal_vehicle` has it, and none is told that rider, tyres or road are others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import codriver.program as programs
from codriver.models.lpv import LPV
from codriver.models.motorcycle import MotorcycleParameters, motorcycle_model
from codriver.models.motorcycle_lean import LeanParameters
from codriver.observers.butterworth import butterworth_filter
from codriver.observers.differentiator import algebraic_differentiator
from codriver.observers.motorcycle_ekf import motorcycle_ekf
from codriver.observers.motorcycle_family import WINDOW, design_for_balance
from codriver.observers.motorcycle_imu import crown_correction, motorcycle_imu
from codriver.observers.motorcycle_kalman import motorcycle_kalman
from codriver.observers.motorcycle_lmi import MotorcycleLMI, design_motorcycle_lmi
from codriver.observers.motorcycle_ts import motorcycle_ts_observer
from codriver.observers.motorcycle_uio import design_motorcycle_uio, motorcycle_uio
from codriver.observers.observer import Observer, chain
from codriver.observers.road_frame import road_frame_observer
from codriver.papers.motorcycle2018.rides import DT, JUDGED
from codriver.papers.motorcycle2018.signed import signed_frame
from codriver.program import Program
from codriver.simulate.motorcycle.files import nominal_vehicle

RANGE = (30 / 3.6, 110 / 3.6)  # m/s
FLAGS = ("valid",)
FILTERED = ("rider_torque", "front_lateral_force")


@cache
def machine() -> MotorcycleParameters:
    """Sharp's."""
    return MotorcycleParameters.from_vehicle(nominal_vehicle())


@cache
def lean_machine() -> LeanParameters:
    """The same with crowns, trail, drag and the IMU's place."""
    return LeanParameters.from_vehicle(nominal_vehicle())


@cache
def model() -> LPV:
    """The augmented model (12)."""
    return motorcycle_model(machine()).with_walking_inputs()


@cache
def lmi(fastest: float | None = 300.0, scheduled: bool = True) -> MotorcycleLMI:
    """The gains of (34).

    Args:
        fastest: bound of the poles, rad/s.
        scheduled: whether the gain goes with the speed.
    """
    return design_motorcycle_lmi(model(), *RANGE, DT, fastest=fastest, scheduled=scheduled)


@cache
def shipped_lmi() -> MotorcycleLMI:
    """That of the estimator `motorcycle-ts`: slower poles, told that a = v W may be 0.7 m/s^2 off; chosen on rides like these."""
    return design_for_balance(model(), DT)


def behind(observer: Observer, way: str = "turn", window: float = WINDOW) -> Observer:
    """An observer of the road's frame behind IMU, encoder and speed.

    Args:
        observer: takes the measurements of (21).
        way: "squares", eq. (17) and (19); "signed", the same with the yaw rate's sign; "turn", a = v W.
        window: of the differentiator, s.
    """
    if way == "signed":
        frame = signed_frame(observer.dt)
    else:
        frame = road_frame_observer(observer.dt, "squares" if way == "squares" else "turn")
    return chain(chain(frame, algebraic_differentiator(observer.dt, window)), observer, observer.name)


@dataclass(frozen=True)
class Method:
    """An observer of the tables.

    Attributes:
        label: for people.
        short: where there is little room.
        color: of its curves.
        make: it.
        fed: it is given the measurements of (21) themselves, `Scene.measures`, and no sensors.
    """

    label: str
    short: str
    color: str
    make: Callable[[], Observer]
    fed: bool = False


METHODS: dict[str, Method] = {
    "paper": Method("LMI observer, acceleration by (17), yaw rate by (19): the paper's", "LMI, (17)", "#C84C00",
                    lambda: behind(motorcycle_ts_observer(lmi()), "squares")),
    "signed": Method("LMI observer, (17) with the sign of the yaw rate, (19)", "LMI, (17) signed", "#B8860B",
                     lambda: behind(motorcycle_ts_observer(lmi()), "signed")),
    "fed": Method("LMI observer, given the measurements of (21) themselves", "LMI, fed", "#B0479B",
                  lambda: motorcycle_ts_observer(lmi()), fed=True),
    "ts": Method("LMI observer, a = v W", "LMI, a = v W", "#0072B2", lambda: behind(motorcycle_ts_observer(lmi()))),
    "constant": Method("LMI observer, a = v W, one gain at all speeds", "LMI, one gain", "#56B4E9",
                       lambda: behind(motorcycle_ts_observer(lmi(scheduled=False)))),
    "shipped": Method("LMI observer as motorcycle-ts has it: slower poles, a = v W trusted less", "LMI, shipped", "#8E2F86",
                      lambda: behind(motorcycle_ts_observer(shipped_lmi()))),
    "kalman": Method("Kalman filter on the same model, a = v W", "Kalman", "#007A5A",
                     lambda: motorcycle_kalman(model(), DT)),
    "uio": Method("unknown-input observer, a = v W", "UIO", "#E69F00",
                  lambda: behind(motorcycle_uio(design_motorcycle_uio(motorcycle_model(machine()), *RANGE, DT), DT))),
    "uio-fed": Method("unknown-input observer, given the measurements of (21) themselves", "UIO, fed", "#B8860B",
                      lambda: motorcycle_uio(design_motorcycle_uio(motorcycle_model(machine()), *RANGE, DT), DT), fed=True),
    "imu": Method("IMU and speed alone, tyres' width known", "IMU", "#757575",
                  lambda: motorcycle_imu(DT, crown_correction(lean_machine()))),
    "imu-plain": Method("IMU and speed alone, a point mass on thin tyres", "IMU, plain", "#A9A9A9", lambda: motorcycle_imu(DT)),
    "ekf": Method("extended Kalman filter at any lean, raw IMU", "EKF", "#2AA9B8", lambda: motorcycle_ekf(lean_machine(), DT)),
}  # fmt: skip


@cache
def program(name: str) -> Program:
    """A method, compiled for what is judged.

    Args:
        name: of METHODS.
    """
    return compiled(METHODS[name].make())


@cache
def filtered(cutoff: float) -> Program:
    """The LMI observer given measurements, torque and front force behind a Butterworth filter of third order.

    Args:
        cutoff: Hz.
    """
    return compiled(chain(motorcycle_ts_observer(lmi()), butterworth_filter(DT, FILTERED, cutoff)))


def compiled(observer: Observer) -> Program:
    """An observer with the outputs that are judged and its flags."""
    there = {output.name for output in observer.outputs}
    return programs.compile(observer, [name for name in (*JUDGED, *FLAGS) if name in there])
