"""The torque that the road puts on a car's steering column, as the driver's hands feel it, from angle and speed.

    T_aln = -T_0 - R / sqrt(1 + |R| / T_s)                 friction = T_c z + b_s omega_s              N m
    R     = k_a (a_f - g e)                                torque of the road, before the assist, N m
    a_f   = v^2 kappa,  kappa = delta_s / (i L (1 + v^2 / v_ch^2))       lateral acceleration of a steady turn, m/s^2
    e     = e_max x / sqrt(1 + x^2),  x = q v_r^2 kappa_r / (g e_max)    bank of the road, rad

delta_s, rad: angle of the wheel. v, m/s: speed. i: steering ratio. L, m: wheelbase. v_ch, m/s: characteristic speed of the
single track. k_a, N m per m/s^2: alignment gain. T_s, N m: the assist takes its share from there on; the map bends and never
saturates. T_0, N m: zero error of sensor and straight road together. Positive to the left: in a turn to the left T_aln is
negative and turns the wheel back.

**The bank.** In a banked curve gravity does part of the tyres' work, and all of it at one speed; a car that crawls along a
motorway's bend is pulled inwards. No sensor here sees the bank, but roads are built to a rule: it grows with the curvature
kappa_r and the square of the speed v_r that the road is made for, up to e_max. q is the share of the lateral acceleration
that it takes over. kappa_r follows kappa over the length of a transition, v_r the speed over a hundred metres upwards and
some kilometres downwards (a queue does not make a motorway a lane). AASHTO, A Policy on Geometric Design of Highways and
Streets, chapter 3, on superelevation.

**Friction.** z, from -1 to 1, is the force of a body that yields before it slides (Dahl 1968): z' = (omega_s - |omega_s| z) /
w with the width w, rad, here by the implicit Euler rule over the angle moved.

**With a single track** a_f is C_f alpha_f / m_f with its slip angle alpha_f as it moves, not of a steady turn. With T_s infinite,
e_max = 0 and T_0 = 0 that is eq. (92) of Okamoto, Tsiotras 2019: T_aln = K_aln / i (beta + l_f r / v - delta) with
K_aln = i k_a C_f / m_f, positive; the paper's K_aln = -K_p C_f n_t would push the wheel away from the middle.

Exact operations only, so that every printer gives the same bits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from codriver.kernel.expressions import select, sqrt
from codriver.models.single_track import SLOWEST, SingleTrack
from codriver.vehicles import Vehicle

# A CasADi SX, a float or an array; CasADi ships no types.
Value = Any
GRAVITY = 9.81  # m/s^2
TRANSITION = 20.0  # m, over which kappa_r follows
ROAD_UP, ROAD_DOWN = 100.0, 3000.0  # m, over which v_r follows
ROAD_SLOWEST = 14.0  # m/s, least v_r: 50 km/h
STATES = ("started", "last_angle", "presliding", "road_curvature", "road_speed", "sideslip_angle", "yaw_rate")
# What a passenger car has where nobody measured it: name in a vehicle file, value (SI).
USUAL = {
    "steering_ratio": 15.0, "wheelbase": 2.8, "characteristic_speed": 28.0, "alignment_gain": 1.0, "alignment_bend": 1.5,
    "alignment_offset": 0.0, "road_bank": 0.04, "road_bank_share": 0.5, "steering_inertia": 0.04, "steering_damping": 0.5,
    "steering_friction": 0.2,
    "steering_friction_width": 0.004,
}  # fmt: skip


@dataclass(frozen=True)
class AlignmentModel:
    """A car's map from angle and speed to the torque on its column.

    Attributes:
        gain: k_a, N m per m/s^2.
        bend: T_s, N m; infinite for none.
        offset: T_0, N m.
        bank: e_max, rad; 0 for level roads.
        bank_share: q, 1.
        steering_ratio: i, 1.
        wheelbase: L, m.
        characteristic_speed: v_ch, m/s; infinite for a neutral car.
        damping: b_s, N m s/rad.
        coulomb: T_c, N m.
        width: w, rad.
        track: the single track whose slip angle moves; None for steady turns.
    """

    gain: float
    bend: float = inf
    offset: float = 0.0
    bank: float = 0.0
    bank_share: float = USUAL["road_bank_share"]
    steering_ratio: float = USUAL["steering_ratio"]
    wheelbase: float = USUAL["wheelbase"]
    characteristic_speed: float = USUAL["characteristic_speed"]
    damping: float = 0.0
    coulomb: float = 0.0
    width: float = USUAL["steering_friction_width"]
    track: SingleTrack | None = None

    def __post_init__(self) -> None:
        for name in ("bend", "steering_ratio", "wheelbase", "characteristic_speed", "width"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name):g}; it must be positive")

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> AlignmentModel:
        """A vehicle's map; what it lacks beside the gain is that of a usual passenger car (`USUAL`).

        Raises:
            VehicleError: the vehicle has no alignment_gain: `codriver identify alignment` finds it.
        """
        own = {name: vehicle.number(name) if name in vehicle else value for name, value in USUAL.items()}
        return cls(
            gain=vehicle.number("alignment_gain"), bend=own["alignment_bend"], offset=own["alignment_offset"],
            bank=own["road_bank"], bank_share=own["road_bank_share"], steering_ratio=own["steering_ratio"],
            wheelbase=own["wheelbase"], characteristic_speed=own["characteristic_speed"], damping=own["steering_damping"],
            coulomb=own["steering_friction"], width=own["steering_friction_width"],
        )  # fmt: skip

    @classmethod
    def eq_92(cls, vehicle: Vehicle) -> AlignmentModel:
        """Eq. (92) with the vehicle's single track and alignment_stiffness = K_aln, N m/rad, positive.

        Raises:
            VehicleError: the vehicle lacks a parameter.
        """
        track, ratio = SingleTrack.from_vehicle(vehicle), vehicle.number("steering_ratio")
        gain = vehicle.number("alignment_stiffness") / ratio * track.front_mass / track.front_stiffness
        return cls(gain, steering_ratio=ratio, wheelbase=track.wheelbase, track=track)

    @property
    def states(self) -> Mapping[str, float]:
        """What is carried from tick to tick, as it starts: all zero; `started` becomes 1 with the first tick."""
        return dict.fromkeys(STATES if self.track is not None else STATES[:5], 0.0)

    def advance(self, states: Mapping[str, Value], angle: Value, speed: Value, dt: float) -> dict[str, Value]:
        """The states a tick later. The first tick takes the angle as it is for the road's curvature, and friction for zero.

        Args:
            states: of the tick before, or `states`.
            angle: delta_s now, rad.
            speed: v now, m/s.
            dt: s since the tick before.
        """
        started = states["started"] > 0.5
        moved = select(started, angle - states["last_angle"], 0.0)
        path = abs(speed) * dt
        now = self.curvature(angle, speed)
        pace = select(abs(speed) > ROAD_SLOWEST, abs(speed), ROAD_SLOWEST)
        before = select(started, states["road_speed"], pace)
        length = select(pace > before, ROAD_UP, ROAD_DOWN)
        last = select(started, states["road_curvature"], now)
        new = {
            "started": 0.0 * angle + 1.0,
            "last_angle": angle,
            "presliding": self.slide(states["presliding"], moved),
            "road_curvature": last + path / (TRANSITION + path) * (now - last),
            "road_speed": before + path / (length + path) * (pace - before),
        }
        if self.track is not None:
            driven = select(speed > SLOWEST, speed, SLOWEST)
            slip = self.track.advance(
                states["sideslip_angle"], states["yaw_rate"], angle / self.steering_ratio, driven, dt
            )
            new |= dict(zip(STATES[5:], slip, strict=True))
        return new

    def torque(self, states: Mapping[str, Value], angle: Value, speed: Value) -> Value:
        """T_aln, N m, positive to the left.

        Args:
            states: as `advance` left them.
            angle: delta_s, rad.
            speed: v, m/s.
        """
        if self.track is None:
            lateral = speed * speed * self.curvature(angle, speed)
        else:
            driven = select(speed > SLOWEST, speed, SLOWEST)
            slip = self.track.front_slip(
                states["sideslip_angle"], states["yaw_rate"], angle / self.steering_ratio, driven
            )
            lateral = self.track.front_stiffness / self.track.front_mass * slip
        return self.felt(lateral - GRAVITY * self.road_bank(states["road_curvature"], states["road_speed"]))

    def friction(self, states: Mapping[str, Value], rate: Value) -> Value:
        """What the column's friction takes from the driver's torque, N m: T_c z + b_s omega_s.

        Args:
            states: as `advance` left them.
            rate: omega_s, rad/s.
        """
        return self.coulomb * states["presliding"] + self.damping * rate

    def curvature(self, angle: Value, speed: Value) -> Value:
        """kappa of a steady turn, 1/m."""
        slower = 1.0 / (self.characteristic_speed * self.characteristic_speed)
        return angle / (self.steering_ratio * self.wheelbase * (1 + speed * speed * slower))

    def felt(self, lateral: Value) -> Value:
        """T_aln of so much lateral acceleration that the tyres give, m/s^2."""
        road = self.gain * lateral
        return -self.offset - road / _root(1 + abs(road) / self.bend)

    def road_bank(self, curvature: Value, speed: Value) -> Value:
        """e, rad, of a road of this curvature, 1/m, made for this speed, m/s."""
        if self.bank == 0:
            return 0.0 * curvature
        x = self.bank_share * speed * speed * curvature / (GRAVITY * self.bank)
        return self.bank * x / _root(1 + x * x)

    def slide(self, presliding: Value, moved: Value) -> Value:
        """z after the wheel moved by so much, rad."""
        return (presliding + moved / self.width) / (1 + abs(moved) / self.width)


def _root(x: Value) -> Value:
    """The square root of a float, an array or a symbol."""
    return np.sqrt(x) if isinstance(x, np.ndarray) else sqrt(x)
