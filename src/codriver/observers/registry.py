"""The estimators by name: what is to be known of each before it is built, and how it is built.

    from codriver.observers import Estimator, register
    register(Estimator("driver-torque", ..., family="torque", build=my_function))

A family is a set of estimators of the same quantity, in order of preference. Its name stands for the best of them that a
log and a vehicle can feed (`feed.best`). Each module of estimators registers its own; the order of registering is the order
of preference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from codriver.errors import UsageError, VehicleError
from codriver.names import nearest
from codriver.observers.observer import Observer
from codriver.observers.preset_file import find_preset, preset_settings
from codriver.observers.scaled_gain import check_tick
from codriver.vehicles import Vehicle, load_vehicle

ESTIMATORS: dict[str, Estimator] = {}


@dataclass(frozen=True)
class Design:
    """What an estimator is to be designed for.

    Attributes:
        dt: tick, s.
        ell: the knob; None takes the preset's.
        preset: noise, a paper's or one's own, of the kind that the estimator takes; None where the estimator has none.
        form: "kalman" or "constant", where the estimator has both.
    """

    dt: float = 0.01
    ell: float | None = None
    preset: Any = None
    form: str = "kalman"


@dataclass(frozen=True)
class Estimator:
    """What is to be known of an estimator before it is built.

    Attributes:
        name: as on the command line.
        parameters: the vehicle parameters it needs; none means it needs no vehicle.
        signals: the signals it needs (beside optional ones), as far as that can be said without a vehicle.
        meaning: what it estimates from what; a sentence without its full stop.
        family: of the estimators of the same quantity.
        build: makes the observer. It gets a vehicle with `parameters` if there are any, else perhaps None.
        preset: the noise it takes by default; None: it has no noise to choose.
        knob: whether it has ell.
        find: reads its kind of preset: a value, a name or a path.
        tell: what provenance says of such a preset.
        learns: whether its noise is fitted to the record where no preset is given.
        forms: the forms it has.
        forbids: parameters of a vehicle that it is not for.
        least: Hz, at which it runs at least where no rate is told; a slower log's samples are used on the ticks they come on.
        varies: whether the vehicle may change which signals it needs; where not, nothing is built to find out.
    """

    name: str
    parameters: tuple[str, ...]
    signals: tuple[str, ...]
    meaning: str
    family: str
    build: Callable[[Vehicle | None, Design], Observer]
    preset: str | None = None
    knob: bool = False
    find: Callable[[Any], Any] = find_preset
    tell: Callable[[Any], dict[str, str]] = preset_settings
    learns: bool = False
    forms: tuple[str, ...] = ("kalman", "constant")
    forbids: tuple[str, ...] = ()
    least: float = 0.0
    varies: bool = True


def register(estimator: Estimator) -> Estimator:
    """Add an estimator, after those of its family that are there.

    Raises:
        UsageError: its name is taken, by an estimator or a family.
    """
    if estimator.name in ESTIMATORS or estimator.name in families() or estimator.family in ESTIMATORS:
        raise UsageError(
            f"an estimator '{estimator.name}' of the family '{estimator.family}'", "names that are free", "rename it"
        )
    ESTIMATORS[estimator.name] = estimator
    return estimator


def families() -> tuple[str, ...]:
    """The families, in the order they were registered."""
    return tuple(dict.fromkeys(estimator.family for estimator in ESTIMATORS.values()))


def get_estimator(name: str) -> Estimator:
    """The entry of ESTIMATORS.

    Raises:
        UsageError: there is no such estimator.
    """
    if name not in ESTIMATORS:
        near = nearest(name, [*ESTIMATORS, *families()])
        raise UsageError(
            f"no estimator is called '{name}'", f"one of {', '.join(ESTIMATORS)}, or {' or '.join(families())}",
            f"did you mean {near}?" if near else "see `codriver estimate --help`",
        )  # fmt: skip
    return ESTIMATORS[name]


def needed_signals(name: str, vehicle: Vehicle | None) -> tuple[str, ...]:
    """The signals an estimator needs with this vehicle: those the observer built for it requires.

    A car of one gear, for example, may not need the gear. Without a vehicle that has all it takes, what the registry says.
    """
    estimator = get_estimator(name)
    if (
        vehicle is None
        or not estimator.varies
        or any(p not in vehicle for p in estimator.parameters)
        or any(p in vehicle for p in estimator.forbids)
    ):
        return estimator.signals
    return build(name, vehicle).required


def build(
    name: str,
    vehicle: Vehicle | str | Path | None = None,
    *,
    dt: float = 0.01,
    ell: float | None = None,
    preset: Any = None,
    form: str = "kalman",
) -> Observer:
    """Build an estimator.

    Args:
        name: one of ESTIMATORS.
        vehicle: loaded, or the name or path that `load_vehicle` takes; not needed by `kinematic`.
        dt: tick, s.
        ell: the knob; None takes the preset's (2 for 2017, 1.4 for 2015).
        preset: noise of a paper by its name, or one's own, as a value or the path of its file; None takes the estimator's,
            which is "bisoffi2017" for all of the family intent. (`intent-torque` is of the 2015 paper, whose own noise is
            "bisoffi2015".) The family driver-torque has presets of another kind, see `torque_noise` and `driver_torque_family`.
        form: "kalman" (missing and multi-rate rows exact) or "constant" (the papers' gain; small).

    Raises:
        UsageError: no such estimator, preset or form; the estimator has no knob or no noise; dt or ell out of range.
        VehicleError: the vehicle is missing, or lacks a parameter.
        DesignError: the design fails its certificate.
    """
    estimator = get_estimator(name)
    check_tick(dt)
    if isinstance(vehicle, (str, Path)):
        vehicle = load_vehicle(vehicle)
    if form not in ("kalman", "constant"):
        raise UsageError(f"form '{form}'", "'kalman' or 'constant'", "choose one")
    if form not in estimator.forms:
        raise UsageError(f"form '{form}' of {name}", " or ".join(estimator.forms), "leave form (--form) out")
    strange = [p for p in estimator.forbids if vehicle is not None and p in vehicle]
    if strange:
        raise VehicleError(
            f"{name} is not for a vehicle with {', '.join(strange)}",
            "one without",
            "see docs/vehicles.md for what it says",
        )
    if estimator.parameters and vehicle is None:
        needless = [e.name for e in ESTIMATORS.values() if e.family == estimator.family and not e.parameters]
        raise VehicleError(
            f"{name} was given no vehicle", f"one with {', '.join(estimator.parameters)}",
            "give a built-in name or a vehicle file (--vehicle)"
            + (f", or use the estimator '{needless[0]}', which needs none" if needless else ""),
        )  # fmt: skip
    if ell is not None and not estimator.knob:
        raise UsageError(f"{name} has no knob, but ell = {ell:g} was given", "no ell", "leave ell (--ell) out")
    if preset is not None and estimator.preset is None:
        raise UsageError(f"{name} has no noise to choose, but a preset was given", "none", "leave it (--preset) out")
    preset = estimator.preset if preset is None else preset
    noise = None if preset is None else estimator.find(preset)
    observer = estimator.build(vehicle, Design(dt, ell, noise, form))
    settings = {"estimator": name, **observer.settings}
    if noise is not None:
        settings |= estimator.tell(noise)
    return replace(observer, name=name, settings=settings)
