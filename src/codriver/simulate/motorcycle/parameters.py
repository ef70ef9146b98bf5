"""What the simulated motorcycle has beyond Sharp's letters: tyres of some width that saturate, radial springs, drag, pitch inertia.

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
class MachineParameters:
    """The simulated motorcycle.

    Attributes:
        sharp: masses, inertias, geometry, stiffnesses at the static loads.
        front, rear: the tyres.
        rear_pitch_inertia, front_pitch_inertia: of the frames about their mass centres, without the wheels' spin inertia, kg m^2.
        drag_area: of the air's drag, at the rear frame's mass centre, m^2.
        air_density: kg/m^3.
        imu: place of the IMU in the rear frame, from the road point below its mass centre when upright, m: forward, left, up.
    """

    sharp: MotorcycleParameters
    front: TyreParameters = FRONT_TYRE
    rear: TyreParameters = REAR_TYRE
    rear_pitch_inertia: float = 35.0
    front_pitch_inertia: float = 1.2
    drag_area: float = 0.6
    air_density: float = 1.2
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
