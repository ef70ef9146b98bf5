"""Driver files: a learned driver as JSON, numbers only.

    {"format": "codriver driver", "version": 1, "name": ..., "kind": "ann", "protocol": {...}, "features": [...],
     "scaling": {...}, "model": {"parameters": {...}, "state": {...}}, "calibration": {...}, "training": {...}}

No code is in such a file, so reading one cannot run anything. Floats are written so that they come back with the same bits. A later
version reads the files of an earlier one; of a later one's it says so.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from codriver.drivers.learned.calibration import Calibration
from codriver.drivers.learned.feature_setting import TARGETS, FeatureSetting
from codriver.drivers.learned.features import Feature, columns_of
from codriver.drivers.learned.kinds import class_of
from codriver.drivers.learned.learned_driver import LearnedDriver
from codriver.drivers.learned.protocol import Protocol
from codriver.drivers.learned.scaling import Scaling
from codriver.errors import FormatError, LogError, UsageError
from codriver.logs.write import complete_or_nothing

FORMAT, VERSION = "codriver driver", 1
SUFFIX = ".driver"
_EXPECTED = "a driver file as `codriver driver fit` writes it"


def check_driver_name(path: str | Path) -> Path:
    """Whether a driver can be written here, asked before long work.

    Raises:
        UsageError: the name does not end in .driver, its folder is not there, or something else is.
    """
    path = Path(path)
    if path.suffix != SUFFIX:
        raise UsageError(f"cannot write a driver to '{path.name}'", f"a name ending in {SUFFIX}", "choose such a name")
    if not path.parent.is_dir():
        raise UsageError(f"the folder {path.parent} does not exist", "an existing folder", "create it first")
    if path.is_dir():
        raise UsageError(f"{path} is a folder", "the name of a file", "choose another name")
    return path


def save_driver(driver: LearnedDriver, path: str | Path) -> Path:
    """Write a driver, whole or not at all.

    Raises:
        UsageError: see `check_driver_name`.
        LogError: it cannot be written.
    """
    path = check_driver_name(path)
    with complete_or_nothing(path) as draft:
        draft.write_text(driver_text(driver), encoding="utf-8", newline="\n")
    return path


def load_driver(path: str | Path) -> LearnedDriver:
    """Read a driver.

    Raises:
        LogError: it cannot be read.
        FormatError: it is no driver file, or one of a later version.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise LogError(f"cannot read {path}: {error.strerror or error}", _EXPECTED, "correct the name") from error
    except UnicodeDecodeError as error:
        raise FormatError(f"{path} is no text", _EXPECTED, "give such a file") from error
    return parse_driver(text, str(path))


def driver_text(driver: LearnedDriver) -> str:
    """The text of a driver file."""
    protocol = {**asdict(driver.protocol), "features": driver.protocol.features.as_plain()}
    whole = {
        "format": FORMAT, "version": VERSION, "name": driver.name, "kind": driver.kind, "target": driver.target,
        "signals": list(driver.signals), "left_out": list(driver.left_out), "protocol": protocol,
        "features": [[f.signal, f.when, f.kind] for f in driver.features], "scaling": driver.scaling.as_plain(),
        "model": {"parameters": _plain(driver.regressor.get_params(deep=False)), "state": _plain(driver.regressor.state())},
        "calibration": driver.calibration.as_plain(), "training": _plain(dict(driver.training)),
    }  # fmt: skip
    return json.dumps(whole, allow_nan=False, indent=1) + "\n"


def parse_driver(text: str, where: str) -> LearnedDriver:
    """A driver from its text.

    Args:
        text: JSON.
        where: the file, for messages.

    Raises:
        FormatError: it is no driver file, or one of a later version.
    """
    try:
        whole = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{where} is no JSON: {error}", _EXPECTED, "give such a file") from error
    if not isinstance(whole, dict) or whole.get("format") != FORMAT:
        raise FormatError(f"{where} holds no driver", _EXPECTED, "give such a file")
    if type(whole.get("version")) is not int or not 1 <= whole["version"] <= VERSION:
        raise FormatError(
            f"{where} is of version {whole.get('version')}", f"version 1 to {VERSION}", "use a newer codriver"
        )
    try:
        return _driver(whole)
    except (KeyError, TypeError, ValueError, UsageError) as error:
        raise FormatError(
            f"{where} is damaged: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else error!r}",
            _EXPECTED, "fit the driver again",
        ) from error  # fmt: skip


def _driver(whole: Mapping[str, Any]) -> LearnedDriver:
    """A driver from a file's content."""
    settings = dict(whole["protocol"])
    protocol = Protocol(**{**settings, "features": FeatureSetting.from_plain(settings["features"])})
    features = tuple(Feature(str(s), float(w), str(k)) for s, w, k in whole["features"])
    scaling = Scaling.from_plain(whole["scaling"])
    if scaling.mean.shape != (len(features),) or scaling.size.shape != (len(features),):
        raise ValueError(f"{len(features)} features and a scaling of {scaling.mean.size}")
    if not (np.all(scaling.size > 0) and scaling.torque_size > 0):
        raise ValueError("a scaling by 0 or less")
    signals, target = tuple(str(s) for s in whole["signals"]), str(whole["target"])
    if target not in TARGETS or features != columns_of(protocol.features, signals, target):
        raise ValueError("the features are not those of its settings and signals")
    calibration = Calibration.from_plain(whole["calibration"])
    if not (calibration.scale > 0 and calibration.nu > 2):
        raise ValueError(f"a band of scale {calibration.scale:g}, nu {calibration.nu:g}")
    made = class_of(whole["kind"])().set_params(**{k: _tuples(v) for k, v in whole["model"]["parameters"].items()})
    made.restore(whole["model"]["state"])
    if getattr(made, "n_features_in_", len(features)) != len(features):
        raise ValueError(f"{len(features)} features and a model of {made.n_features_in_}")
    return LearnedDriver(
        str(whole["name"]), str(whole["kind"]), protocol, signals, target, features, scaling,
        made, calibration, dict(whole["training"]), tuple(whole["left_out"]),
    )  # fmt: skip


def _refuse_constant(text: str) -> None:
    """Keep NaN and infinities out, which JSON does not know.

    Raises:
        ValueError: always.
    """
    raise ValueError(f"{text} is no number")


def _plain(value: Any) -> Any:
    """Numbers, texts, lists and mappings of them.

    Raises:
        TypeError: it holds something else.
    """
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple | range):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"a {type(value).__name__} cannot be stored as plain numbers")


def _tuples(value: Any) -> Any:
    """A parameter as it was given: sequences as tuples."""
    return tuple(value) if isinstance(value, list) else value
