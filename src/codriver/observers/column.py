"""What acts on a steering column beside the driver's hands: the known torque of the driver-torque estimators.

    T_k = T_aln - T_f                             torque of the tyres or of the motor that stands for them, less friction

    logged     T_aln = alignment_torque                               a simulator's log
    motor      T_aln = steering_motor_torque                          a force-feedback wheel: the motor is all that acts
    command    T_aln = torque_scale T_com + torque_offset             the same, in the device's own unit (89)
    map        T_aln of `models.alignment`, from angle and speed      a car: tyres less assist, as hands feel them
    assist     the same of tyres alone, and steering_motor_torque     a car whose motor's torque is known
    track      (92) with a single track, from angle and speed         a car whose tyres are known

Friction of the first three is Dahl's: its state z runs towards the direction of motion within the angle w, so nothing chatters when
an encoder's last digit does:

    z <- (z + m / w) / (1 + |m| / w) when the wheel moves by m,   z <- z exp(-dt / REST) while it rests,   T_f = T_c z

A wheel that sticks can hold any torque up to T_c, and what it holds soon has nothing to do with how it came to rest: so z
fades, and the variance of T_f is T_c^2 (1 - z^2) / 3 + (sd of T_c)^2 z^2, that of a uniform torque where z = 0. REST is from
simulated drivers: docs/driver-torque.md. Errors of torque_scale and torque_offset are in the variance, too. A car's map has its
own friction, and its error is known as a whole, from drives it was not fitted to.
Dahl 1968 (Aerospace Corporation, TOR-0158(3107-18)-1).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, pi

from codriver.finding import Finding
from codriver.kernel import Scalar, both, select
from codriver.models.alignment import AlignmentModel
from codriver.observers.observer import Scalars
from codriver.vehicles import Vehicle

WIDTH = 0.2 * pi / 180  # rad, where the vehicle file says nothing
FRICTION_SD = 0.1  # of T_c, where the vehicle file says nothing
# What steering wheels of cars and simulators have; trucks, forks and models may well lie outside.
USUAL_WHEELS = (
    ("J_s", 0.005, 0.2, "kg m^2"), ("b_s", 0.01, 3.0, "N m s/rad"), ("T_c", 0.0, 2.0, "N m"),
)  # fmt: skip
REST = 0.5  # s, in which a resting wheel forgets how it came to rest


@dataclass(frozen=True)
class Moment:
    """What a tick tells of the column.

    Attributes:
        torque: all that acts beside the hands, N m.
        variance: of it, (N m)^2.
        known: 1 where all of it is there.
        memory: the new carry.
    """

    torque: Scalar
    variance: Scalar
    known: Scalar
    memory: Scalars


@dataclass(frozen=True)
class Column:
    """A source of that torque.

    Attributes:
        inputs: standard names it reads, held.
        carry: its carried scalars and their start.
        at: (carry, u, ok, angle, moved) -> Moment; the angle is the wheel's, unwrapped, rad; `moved` by how much since the last
            sample, 0 on ticks without one.
        settings: for provenance.
        optional: those of the inputs that need not be there.
        error: standard deviation of the torque's error that stays for long, N m.
    """

    inputs: tuple[str, ...]
    carry: Mapping[str, float]
    at: Callable[[Scalars, Scalars, Scalars, Scalar, Scalar], Moment]
    settings: Mapping[str, str | float]
    optional: frozenset[str] = frozenset()
    error: float = 0.0


def logged_column(vehicle: Vehicle, dt: float, name: str = "alignment_torque") -> Column:
    """The torque that the log holds under a name, less friction.

    Args:
        vehicle: with steering_friction, if there is friction; with torque_scale for `steering_motor_command`.
        dt: tick, s.
        name: "alignment_torque", "steering_motor_torque" or "steering_motor_command".
    """
    scale, offset, sd_scale, sd_offset = 1.0, 0.0, 0.0, 0.0
    if name == "steering_motor_command":
        scale, sd_scale = _with_sd(vehicle, "torque_scale")
        offset, sd_offset = _with_sd(vehicle, "torque_offset")
    rubbing = friction_of(vehicle, dt)

    def at(carry: Scalars, u: Scalars, ok: Scalars, angle: Scalar, moved: Scalar) -> Moment:
        there = ok[name]
        value = select(there, u[name], 0.0)
        z, against, variance = rubbing.at(carry["bristle"], moved)
        variance = variance + (sd_scale * value) * (sd_scale * value) + sd_offset**2
        return Moment(scale * value + offset - against, variance, there, {"bristle": z})

    return Column((name,), {"bristle": 0.0}, at, {"known_torque": name, **rubbing.settings})


def _with_sd(vehicle: Vehicle, name: str) -> tuple[float, float]:
    """A parameter and its standard deviation; 0 where there is none."""
    if name not in vehicle:
        return 0.0, 0.0
    sd = vehicle.parameters[name].sd
    return vehicle.number(name), float(sd) if isinstance(sd, (int, float)) else 0.0


@dataclass(frozen=True)
class Friction:
    """Coulomb friction with presliding.

    Attributes:
        level: T_c, N m.
        sd: of T_c, N m.
        width: w, rad.
        keep: what is left of z after a tick at rest.
    """

    level: float
    sd: float
    width: float
    keep: float

    def at(self, z: Scalar, moved: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The new state, the torque against the motion (N m) and its variance, after the wheel moved by so much (rad)."""
        if self.level == 0:
            return z, 0.0, 0.0
        size = select(moved < 0, -moved, moved) / self.width
        new = select(size > 0, (z + moved / self.width) / (1.0 + size), self.keep * z)
        square = new * new
        spread = self.level**2 / 3.0
        return new, self.level * new, spread * (1.0 - square) + self.sd**2 * square

    @property
    def settings(self) -> dict[str, str | float]:
        """For provenance."""
        return {"friction": self.level} if self.level else {}


def friction_of(vehicle: Vehicle, dt: float) -> Friction:
    """The friction of a vehicle file, for a tick, s; none where it has none."""
    level = vehicle.number("steering_friction") if "steering_friction" in vehicle else 0.0
    given = vehicle.parameters["steering_friction"].sd if level else None
    sd = float(given) if isinstance(given, (int, float)) else FRICTION_SD * level
    name = "steering_friction_width"
    width = vehicle.number(name) if name in vehicle else WIDTH
    return Friction(level, sd, width, exp(-dt / REST))


def wheel_findings(vehicle: Vehicle, settings: Mapping[str, str]) -> list[Finding]:
    """What a vehicle file leaves open or has unusual of the wheel; an estimate's settings hold J_s and b_s as they were used."""
    found = []
    car = "alignment_gain" in vehicle and settings.get("known_torque", "").startswith("map")
    if "steering_friction" not in vehicle and not car:
        found.append(Finding(
            "warn", f"vehicle '{vehicle.name}' has no steering_friction: what friction holds counts as the driver's torque, "
            "outside the band; codriver identify steering-wheel finds it, 0 says there is none",
        ))  # fmt: skip
    if "steering_inertia" not in vehicle:
        found.append(
            Finding(
                "ok", f"J_s = {float(settings['J_s']):g} kg m^2 of a usual car's wheel is assumed: the file has none"
            )
        )
    for letter, low, high, unit in USUAL_WHEELS:
        value = settings.get(letter) or settings.get({"T_c": "friction"}.get(letter, ""), "nan")
        if float(value) > high or float(value) < low:
            usual = f"cars and simulators have {low:g} to {high:g}"
            found.append(
                Finding("warn", f"{letter} = {float(value):.3g} {unit} is unusual ({usual}): is it this wheel's?")
            )
    return found


def car_column(vehicle: Vehicle, dt: float) -> Column:
    """The torque of a car's tyres less its assist, from angle and speed, by the map that `codriver identify alignment` found.

    Args:
        vehicle: with alignment_gain; alignment_torque_sd is the map's error, N m, friction and all.
        dt: tick, s.
    """
    model = AlignmentModel.from_vehicle(vehicle)
    error = vehicle.number("alignment_torque_sd") if "alignment_torque_sd" in vehicle else 0.0

    def at(carry: Scalars, u: Scalars, ok: Scalars, angle: Scalar, moved: Scalar) -> Moment:
        torque, states, there = _mapped(model, carry, u, ok, angle, dt)
        return Moment(torque - model.coulomb * states["map_presliding"], error**2, there, states)

    return Column(
        ("longitudinal_speed",), _map_carry(model), at, {"known_torque": "map of angle and speed"}, error=error
    )


def assist_column(vehicle: Vehicle, dt: float) -> Column:
    """The torque of a car's tyres, from angle and speed, and that of its motor.

    Args:
        vehicle: with alignment_gain and alignment_whole, as `codriver identify alignment --torque steering_motor_torque`
            writes it from drives without hands; alignment_torque_sd is the map's error, N m.
        dt: tick, s.
    """
    model, motor = AlignmentModel.from_vehicle(vehicle), "steering_motor_torque"
    error = vehicle.number("alignment_torque_sd") if "alignment_torque_sd" in vehicle else 0.0

    def at(carry: Scalars, u: Scalars, ok: Scalars, angle: Scalar, moved: Scalar) -> Moment:
        load, states, there = _mapped(model, carry, u, ok, angle, dt)
        torque = load + select(ok[motor], u[motor], 0.0) - model.coulomb * states["map_presliding"]
        return Moment(torque, error**2, both(there, ok[motor]), states)

    settings = {"known_torque": "map of angle and speed, motor"}
    return Column(("longitudinal_speed", motor), _map_carry(model), at, settings, error=error)


def single_track_column(vehicle: Vehicle, dt: float) -> Column:
    """The tyres' torque by eq. (92), sideslip and yaw rate by a single track, from angle and speed.

    Args:
        vehicle: with alignment_stiffness and the parameters of `SingleTrack`; alignment_torque_sd is its error, N m.
        dt: tick, s.
    """
    model, rubbing = AlignmentModel.eq_92(vehicle), friction_of(vehicle, dt)
    error = vehicle.number("alignment_torque_sd") if "alignment_torque_sd" in vehicle else 0.0

    def at(carry: Scalars, u: Scalars, ok: Scalars, angle: Scalar, moved: Scalar) -> Moment:
        torque, states, there = _mapped(model, carry, u, ok, angle, dt)
        z, against, spread = rubbing.at(carry["bristle"], moved)
        return Moment(torque - against, error**2 + spread, there, {**states, "bristle": z})

    settings = {"known_torque": "eq. (92), single track", **rubbing.settings}
    return Column(("longitudinal_speed",), {**_map_carry(model), "bristle": 0.0}, at, settings, error=error)


def _map_carry(model: AlignmentModel) -> dict[str, float]:
    """The carried scalars of a map."""
    return {f"map_{name}": value for name, value in model.states.items()}


def _mapped(
    model: AlignmentModel, carry: Scalars, u: Scalars, ok: Scalars, angle: Scalar, dt: float
) -> tuple[Scalar, Scalars, Scalar]:
    """Torque of a map, its new carry, and whether the speed is there; without speed it stays as it was."""
    there = ok["longitudinal_speed"]
    speed = select(there, u["longitudinal_speed"], 0.0)
    before = {name: carry[f"map_{name}"] for name in model.states}
    states = model.advance(before, angle, speed, dt)
    memory = {f"map_{name}": select(there, states[name], before[name]) for name in model.states}
    return model.torque(states, angle, speed), memory, there
