"""Scale files: a scale as TOML, one table a speed band.

    name = "our fleet"
    source = "31 logs of spring, drivers unknown"
    observer = "intent-pedals"
    drivers = 31
    thresholds = [-0.4, 0.5]
    without_pedal = [-0.4, 0.5]
    [settings]
    ell = "2.0"
    preset = "bisoffi2017"
    [urban]
    seconds = 410.0
    [urban.jerk_rms]
    mean = -0.6
    step = 0.4
    scatter = 0.3

Means are natural logarithms (rms and peak in m/s^3, reversals in 1/min). A feature that the reference did not show is left out.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from codriver.drivers.bands import BANDS
from codriver.drivers.scale import FEATURES, Scale
from codriver.errors import UsageError
from codriver.logs.write import complete_or_nothing
from codriver.toml_file import parse_tables, quoted, read_text

_KEYS = ("mean", "step", "scatter")
_EXPECTED = "a scale file as `codriver style --write-reference` writes it"


def default_scale() -> Scale:
    """The scale that comes with codriver: six simulated drivers on simulated roads (docs/styles.md)."""
    text = resources.files("codriver.drivers").joinpath("data", "simulated.toml").read_text(encoding="utf-8")
    return parse_scale(text, "the built-in scale")


def load_scale(path: str | Path) -> Scale:
    """Read a scale file.

    Raises:
        UsageError: it cannot be read, or is no scale; the message says what is wrong.
    """
    return parse_scale(read_text(path, "scale file", UsageError), str(path))


def check_scale_name(path: str | Path, *, overwrite: bool = False) -> Path:
    """Whether a scale can be written here, asked before long work.

    Args:
        path: to write to.
        overwrite: whether a scale that is there may be replaced; anything else never.

    Raises:
        UsageError: the name does not end in .toml, the folder does not exist, or something is there already.
    """
    path = Path(path)
    if path.suffix != ".toml":
        raise UsageError(f"cannot write a scale to '{path.name}'", "a name ending in .toml", "choose such a name")
    if path.exists():
        if not overwrite:
            raise UsageError(
                f"{path} is there already", "the name of a new file", "choose another name, or say --overwrite"
            )
        load_scale(path)
    if not path.parent.is_dir():
        raise UsageError(f"the folder {path.parent} does not exist", "an existing folder", "create it first")
    return path


def save_scale(scale: Scale, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a scale file that `load_scale` reads, whole or not at all; what is there is replaced only with `overwrite`.

    Raises:
        UsageError: see `check_scale_name`.
        LogError: it cannot be written.
    """
    path = check_scale_name(path, overwrite=overwrite)
    with complete_or_nothing(path) as draft:
        draft.write_text(scale_text(scale), encoding="utf-8", newline="\n")
    return path


def scale_text(scale: Scale) -> str:
    """The text of a scale file."""
    lines = [
        f"name = {quoted(scale.name)}", f"source = {quoted(scale.source)}", f"observer = {quoted(scale.observer)}",
        f"drivers = {scale.drivers}", f"thresholds = [{scale.thresholds[0]!r}, {scale.thresholds[1]!r}]",
        f"without_pedal = [{scale.without_pedal[0]!r}, {scale.without_pedal[1]!r}]", "", "[settings]",
        *(f"{key} = {quoted(value)}" for key, value in scale.settings.items()),
    ]  # fmt: skip
    for b, band in enumerate(BANDS):
        lines += ["", f"[{band.name}]", f"seconds = {float(scale.seconds[b])!r}"]
        for f, feature in enumerate(FEATURES):
            numbers = [float(array[b, f]) for array in (scale.mean, scale.step, scale.scatter)]
            if np.isfinite(numbers).all():
                lines.append(f"[{band.name}.{feature}]")
                lines += [f"{key} = {value!r}" for key, value in zip(_KEYS, numbers, strict=True)]
    return "\n".join(lines) + "\n"


def parse_scale(text: str, where: str) -> Scale:
    """A scale from its text.

    Args:
        text: TOML.
        where: the file, for messages.

    Raises:
        UsageError: it is no scale.
    """
    table = parse_tables(text, where, UsageError)
    known = {
        "name",
        "source",
        "observer",
        "drivers",
        "thresholds",
        "without_pedal",
        "settings",
        *(b.name for b in BANDS),
    }
    strange = sorted(set(table) - known)
    if strange:
        raise _wrong(where, f"'{strange[0]}' stands in it", "remove it")
    shape = len(BANDS), len(FEATURES)
    arrays = {key: np.full(shape, np.nan) for key in _KEYS}
    seconds = np.zeros(len(BANDS))
    for b, band in enumerate(BANDS):
        part = _table(table.get(band.name, {}), where, band.name)
        seconds[b] = _number(part.get("seconds", 0.0), where, f"{band.name}.seconds", least=0.0)
        for f, feature in enumerate(FEATURES):
            if feature not in part:
                continue
            numbers = _table(part[feature], where, f"{band.name}.{feature}")
            for key in _KEYS:
                arrays[key][b, f] = _number(numbers.get(key), where, f"{band.name}.{feature}.{key}")
            if arrays["scatter"][b, f] <= 0:
                raise _wrong(where, f"{band.name}.{feature}.scatter is not above 0", "correct it")
    if not np.isfinite(arrays["mean"]).any():
        raise _wrong(where, "it holds no feature of any band", "write it again")
    settings = {str(key): str(value) for key, value in _table(table.get("settings", {}), where, "settings").items()}
    return Scale(
        _word(table, "name", where), _word(table, "source", where), _word(table, "observer", where), settings,
        arrays["mean"], arrays["step"], arrays["scatter"], seconds, _pair(table, "thresholds", where),
        _pair(table, "without_pedal", where), int(_number(table.get("drivers"), where, "drivers", least=1)),
    )  # fmt: skip


def _table(value: Any, where: str, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _wrong(where, f"'{name}' is no table", f"write it as [{name}]")
    return value


def _word(table: dict[str, Any], key: str, where: str) -> str:
    if not isinstance(table.get(key), str):
        raise _wrong(where, f"'{key}' is missing or no text", f'add {key} = "..."')
    return str(table[key])


def _number(value: Any, where: str, name: str, least: float = -np.inf) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value) or value < least:
        raise _wrong(where, f"'{name}' is {value!r}", "correct it")
    return float(value)


def _pair(table: dict[str, Any], key: str, where: str) -> tuple[float, float]:
    value = table.get(key)
    if not isinstance(value, list) or len(value) != 2:
        raise _wrong(where, f"'{key}' is {value!r}", f"write {key} = [low, high]")
    low, high = (_number(x, where, key) for x in value)
    if low >= high:
        raise _wrong(where, f"'{key}' is {value!r}", "write the lower one first")
    return low, high


def _wrong(where: str, what: str, do: str) -> UsageError:
    return UsageError(f"{where}: {what}", _EXPECTED, do)
