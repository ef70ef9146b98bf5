"""Drivers for the circuit who differ in how they steer, by name.

Their parameters are made up. All of them keep the rig's car on the circuit at 30 to 50 km/h, with and without variability.
"""

from __future__ import annotations

from codriver.errors import UsageError
from codriver.models.two_point import TwoPointDriver

CIRCUIT_DRIVERS: dict[str, TwoPointDriver] = {
    "anna": TwoPointDriver(),
    "ben": TwoPointDriver(
        anticipation=5.0, compensation=6.0, delay=0.16, reflex=5.0, far=1.2
    ),  # looks far, corrects little
    "carla": TwoPointDriver(anticipation=4.0, compensation=12.0, delay=0.08, reflex=8.0, muscle=0.08),  # tight
    "david": TwoPointDriver(
        anticipation=4.7, compensation=7.0, lead=1.5, delay=0.15, reflex=4.0, muscle=0.15
    ),  # soft arms
    "emma": TwoPointDriver(
        anticipation=4.2, compensation=10.0, lead=0.9, lag=0.3, delay=0.12, reflex=10.0
    ),  # stiff arms
}


def circuit_driver(name: str) -> TwoPointDriver:
    """A driver by name.

    Raises:
        UsageError: there is none of that name.
    """
    try:
        return CIRCUIT_DRIVERS[name]
    except KeyError:
        raise UsageError(
            f"driver '{name}'", f"one of {', '.join(CIRCUIT_DRIVERS)}, or a driver's file NAME.toml",
            "choose one of these, or give a file",
        ) from None  # fmt: skip


def name_of(driver: TwoPointDriver) -> str | None:
    """The name of a driver of CIRCUIT_DRIVERS, none of another."""
    return next((name for name, known in CIRCUIT_DRIVERS.items() if known == driver), None)
