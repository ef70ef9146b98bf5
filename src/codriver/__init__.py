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
    from codriver.estimate_file import save_estimate as save_estimate
    from codriver.export import export_c as export_c
    from codriver.live import BusDecoder as BusDecoder
    from codriver.live import Live as Live
    from codriver.live import listen as listen
    from codriver.logs import open_recording as open_recording
    from codriver.logs import read as read
    from codriver.logs import reader as reader
    from codriver.logs.names_file import load_names as load_names
    from codriver.models import StateSpace as StateSpace
    from codriver.models import intention_model as intention_model
    from codriver.observers import ESTIMATORS as ESTIMATORS
    from codriver.observers import Certificate as Certificate
    from codriver.observers import Estimator as Estimator
    from codriver.observers import Observer as Observer
    from codriver.observers import Output as Output
    from codriver.observers import Preset as Preset
    from codriver.observers import best as best
    from codriver.observers import build as build
    from codriver.observers import chain as chain
    from codriver.observers import design_scaled_gain as design_scaled_gain
    from codriver.observers import feeds as feeds
    from codriver.program import Program as Program
    from codriver.program import Stepper as Stepper
    from codriver.program import compile as compile
    from codriver.report import write_report as write_report
    from codriver.run import estimate_log as estimate_log
    from codriver.signals import Channel as Channel
    from codriver.signals import Grid as Grid
    from codriver.signals import Log as Log
    from codriver.signals import Sampler as Sampler
    from codriver.signals import Signal as Signal
    from codriver.summary import Summary as Summary
    from codriver.summary import summarise as summarise
    from codriver.trust import Check as Check
    from codriver.trust import Finding as Finding
    from codriver.vehicles import Parameter as Parameter
    from codriver.vehicles import Vehicle as Vehicle
    from codriver.vehicles import load_vehicle as load_vehicle
    from codriver.vehicles import save_vehicle as save_vehicle

__version__ = "0.1.0"

# Which module each public name is in.
_NAMES = {
    "errors": ("CodriverError",),
    "estimate": ("Estimate",),
    "estimate_file": ("save_estimate",),
    "export": ("export_c",),
    "live": ("BusDecoder", "Live", "listen"),
    "logs": ("open_recording", "read", "reader"),
    "logs.names_file": ("load_names",),
    "models": ("StateSpace", "intention_model"),
    "observers": (
        "Certificate", "ESTIMATORS", "Estimator", "Observer", "Output", "Preset",
        "best", "build", "chain", "design_scaled_gain", "feeds",
    ),
    "program": ("Program", "Stepper", "compile"),
    "report": ("write_report",),
    "run": ("estimate_log",),
    "signals": ("Channel", "Grid", "Log", "Sampler", "Signal"),
    "summary": ("Summary", "summarise"),
    "trust": ("Check", "Finding"),
    "vehicles": ("Parameter", "Vehicle", "load_vehicle", "save_vehicle"),
}  # fmt: skip
_HOME = {name: module for module, names in _NAMES.items() for name in names}
__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"codriver.{_HOME[name]}"), name)
    raise AttributeError(f"module 'codriver' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __all__
