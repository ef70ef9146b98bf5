"""Another rider on the same machine, or worn tyres: what a ride differs by from the machine that an observer was designed for.

    C_1' = C_1 K(N') / K(N),   C_2' = C_2 N' / N             the same tyre under another static load

A rider of another weight moves the rear frame's mass centre, from which a, b, f, hips and IMU are measured; loaded radii stay.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan, cos, sin

import numpy as np

from codriver.errors import UsageError
from codriver.simulate.motorcycle.kinematics import solids
from codriver.simulate.motorcycle.masses import solid, without
from codriver.simulate.motorcycle.parameters import MachineParameters, TyreParameters

NOMINAL_RIDER = 75.0  # kg, taken to be in Sharp's rear frame
UPPER_SHARE = 0.6  # of the rider's mass, above the hips
_SEATED = (-0.1, 0.0, 0.93)  # m, the rider's mass centre from the road point below the rear frame's
_GYRATION = (0.06, 0.06, 0.02)  # m^2
LIGHTEST, HEAVIEST = 40.0, 150.0  # kg


def with_rider(machine: MachineParameters, mass: float) -> MachineParameters:
    """The machine under a rider of another mass.

    Args:
        machine: with a rider of `NOMINAL_RIDER`.
        mass: kg.

    Raises:
        UsageError: nobody weighs so.
    """
    if not LIGHTEST <= mass <= HEAVIEST:
        raise UsageError(f"a rider of {mass:g} kg", f"{LIGHTEST:g} to {HEAVIEST:g} kg", "choose one of these")
    if mass == NOMINAL_RIDER:
        return machine
    more = mass - NOMINAL_RIDER
    rear = without(solids(machine)[0], [solid(-more, _SEATED, -more * np.array(_GYRATION))])
    p = machine.sharp
    dx, dz = float(rear.centre[0]), float(rear.centre[2])
    moved = replace(
        p, Mr=rear.mass, h=dz, Irx=float(rear.inertia[0, 0]), Irz=float(rear.inertia[2, 2]), Crxz=float(rear.inertia[0, 2]),
        a=p.a - dx * cos(p.eps), b=p.b + dx, f=p.f + dx * sin(p.eps),
    )  # fmt: skip
    body = machine.upper_body
    if body is not None:
        scale = mass / NOMINAL_RIDER
        roll, pitch, yaw = body.inertia
        body = replace(
            body, mass=UPPER_SHARE * mass, hip=(body.hip[0] - dx, body.hip[1]), stiffness=scale * body.stiffness,
            damping=scale * body.damping, inertia=(scale * roll, scale * pitch, scale * yaw),
        )  # fmt: skip
    heavier = replace(
        machine, sharp=moved, upper_body=body, rear_pitch_inertia=float(rear.inertia[1, 1]),
        imu=(machine.imu[0] - dx, *machine.imu[1:]),
    )  # fmt: skip
    (front, rear_load), (new_front, new_rear) = machine.loads, heavier.loads
    loaded = replace(
        moved, load=new_front,
        Cf1=p.Cf1 * _stiffer(machine.front, new_front / front), Cf2=p.Cf2 * new_front / front,
        Cr1=p.Cr1 * _stiffer(machine.rear, new_rear / rear_load), Cr2=p.Cr2 * new_rear / rear_load,
    )  # fmt: skip
    return replace(
        heavier, sharp=loaded,
        front=replace(machine.front, peak_load=machine.front.peak_load * front / new_front),
        rear=replace(machine.rear, peak_load=machine.rear.peak_load * rear_load / new_rear),
    )  # fmt: skip


def _stiffer(tyre: TyreParameters, ratio: float) -> float:
    """K at another load, over K at the static load, `tyre.cornering_stiffness`."""
    return sin(2 * atan(ratio / tyre.peak_load)) / sin(2 * atan(1 / tyre.peak_load))


def with_tyres(machine: MachineParameters, share: float) -> MachineParameters:
    """The machine on tyres whose cornering and camber stiffness is another.

    Args:
        machine: the machine.
        share: of its stiffnesses, 0.7 for 30 % less.

    Raises:
        UsageError: no tyre is so.
    """
    if not 0.3 <= share <= 2:
        raise UsageError(f"tyres of {share:g} times their stiffness", "0.3 to 2 times", "choose one of these")
    p = machine.sharp
    softer = replace(p, Cf1=share * p.Cf1, Cf2=share * p.Cf2, Cr1=share * p.Cr1, Cr2=share * p.Cr2)
    return replace(machine, sharp=softer)
