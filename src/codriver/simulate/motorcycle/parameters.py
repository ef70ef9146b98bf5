"""What the simulated motorcycle has beyond Sharp's letters: tyres of some width that saturate, springs, a rider's body, drag.

Suspension and upper body are taken out of Sharp's frames (`masses`): with both at rest the machine is his as before.

Defaults are of the order that road tyres and machines have; none is taken from a measured machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

from codriver.models.motorcycle import MotorcycleParameters


@dataclass(frozen=True)
class TyreParameters:
    """A tyre, beside its stiffnesses and relaxation length.

    Attributes:
        crown: radius of the tyre's cross-section, m.
        friction: mu, of the peak force to the load.
        shape: C of the magic formula.
        curvature: E of the magic formula.
        pneumatic_trail: of the lateral force at no slip, m.
        peak_load: load of the greatest cornering stiffness, in static loads.
        slip_stiffness: of the longitudinal force at the static load over that load.
        radial_stiffness: N/m.
        radial_damping: N s/m.
    """

    crown: float
    friction: float = 1.2
    shape: float = 1.3
    curvature: float = -0.5
    pneumatic_trail: float = 0.02
    peak_load: float = 2.5
    slip_stiffness: float = 15.0
    radial_stiffness: float = 150e3
    radial_damping: float = 1000.0


FRONT_TYRE = TyreParameters(crown=0.05)
REAR_TYRE = TyreParameters(crown=0.09)


@dataclass(frozen=True)
class Suspension:
    """Telescopic fork along the steer axis, rear wheel along the rear frame's upright; the springs hold the machine at no travel.

    Attributes:
        front_unsprung, rear_unsprung: mass that goes with the wheels, a point at the hub, kg.
        front_stiffness, rear_stiffness: at the wheel, N/m.
        front_damping, rear_damping: N s/m.
    """

    front_unsprung: float = 12.0
    rear_unsprung: float = 18.0
    front_stiffness: float = 13e3
    rear_stiffness: float = 22e3
    front_damping: float = 900.0
    rear_damping: float = 1300.0


@dataclass(frozen=True)
class UpperBody:
    """The rider from the hips up: leans to either side about an axis along the rear frame.

    Attributes:
        mass: kg.
        hip: in front of the rear frame's mass centre, and above the road, m.
        above: mass centre above the hip, m.
        inertia: about its mass centre: roll, pitch, yaw, kg m^2.
        stiffness: of the hips, N m/rad; must hold the body up against its weight.
        damping: N m s/rad.
    """

    mass: float = 45.0
    hip: tuple[float, float] = (-0.1, 0.75)
    above: float = 0.3
    inertia: tuple[float, float, float] = (2.2, 2.0, 0.8)
    stiffness: float = 350.0
    damping: float = 35.0


@dataclass(frozen=True)
class MachineParameters:
    """The simulated motorcycle.

    Attributes:
        sharp: masses, inertias, geometry, stiffnesses at the static loads.
        front, rear: the tyres.
        rear_pitch_inertia, front_pitch_inertia: of the frames about their mass centres, without the wheels' spin inertia, kg m^2.
        drag_area: of the air's drag, at the rear frame's mass centre, m^2.
        air_density: kg/m^3.
        suspension: None for wheels that are rigid in their frames.
        upper_body: None for a rider who sits still.
        imu: place of the IMU in the rear frame, from the road point below its mass centre when upright, m: forward, left, up.
    """

    sharp: MotorcycleParameters
    front: TyreParameters = FRONT_TYRE
    rear: TyreParameters = REAR_TYRE
    rear_pitch_inertia: float = 35.0
    front_pitch_inertia: float = 1.2
    drag_area: float = 0.6
    air_density: float = 1.2
    suspension: Suspension | None = None
    upper_body: UpperBody | None = None
    imu: tuple[float, float, float] = (0.1, 0.03, 0.8)

    @property
    def loads(self) -> tuple[float, float]:
        """Static loads of front and rear wheel from masses and geometry, N."""
        p = self.sharp
        whole = p.mass * p.g
        k = (p.a + p.e) * cos(p.eps) - p.f * sin(p.eps)
        centre = p.Mf * k / p.mass
        front = whole * (p.b + centre) / (p.b + p.front)
        return front, whole - front
