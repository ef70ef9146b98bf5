"""codriver: virtual sensors for what the person driving or riding intends and does.

    import codriver as cd

    log = cd.read("drive.blf", dbc="car.dbc", names="names.toml")
    vehicle = cd.load_vehicle("bisoffi2017")
    observer = cd.build("intent-pedals", vehicle, dt=0.01, ell=2)
    estimate = cd.compile(observer).run(log)
    print(estimate.check().verdict)

Importing codriver loads numpy at most; each public name is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from codriver.errors import CodriverError as CodriverError
    from codriver.estimate import Estimate as Estimate
    from codriver.logs import open_recording as open_recording
    from codriver.logs import read as read
    from codriver.logs import reader as reader
    from codriver.models import StateSpace as StateSpace
    from codriver.models import intention_model as intention_model
    from codriver.observers import Certificate as Certificate
    from codriver.observers import Observer as Observer
    from codriver.observers import build as build
    from codriver.observers import chain as chain
    from codriver.observers import design_scaled_gain as design_scaled_gain
    from codriver.program import Program as Program
    from codriver.program import Stepper as Stepper
    from codriver.program import compile as compile
    from codriver.signals import Channel as Channel
    from codriver.signals import Grid as Grid
    from codriver.signals import Log as Log
    from codriver.signals import Sampler as Sampler
    from codriver.signals import Signal as Signal
    from codriver.vehicles import Vehicle as Vehicle
    from codriver.vehicles import load_vehicle as load_vehicle

__version__ = "0.1.0"

_HOME = {
    "CodriverError": "errors", "Estimate": "estimate", "open_recording": "logs", "read": "logs", "reader": "logs",
    "StateSpace": "models", "intention_model": "models", "Certificate": "observers", "Observer": "observers",
    "build": "observers", "chain": "observers", "design_scaled_gain": "observers", "Program": "program",
    "Stepper": "program", "compile": "program", "Channel": "signals", "Grid": "signals", "Log": "signals",
    "Sampler": "signals", "Signal": "signals", "Vehicle": "vehicles", "load_vehicle": "vehicles",
}  # fmt: skip
__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"codriver.{_HOME[name]}"), name)
    raise AttributeError(f"module 'codriver' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
