"""Presets in files: the noise of one's own sensors and drives, as `codriver tune` writes it.

    name = "my-car"
    source = "tuned on drive.blf"
    ell = 1.7
    Q = [1e-2, 1e-4, 1e-1, 1.0]   # intensities of v (m^2/s^3), a_i (m^2/s^5), o_a (m^2/s^5), j_i (m^2/s^7)
    R = [1.0, 1e-2]               # of the accelerometer (m^2/s^3) and the speed (m^2/s)

Only ratios of Q and R fix the gain, so their common factor is free (`noise_scale`). A file is read strictly, as vehicle
files are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar

from codriver.errors import UsageError
from codriver.names import nearest
from codriver.observers.scaled_gain import ELL_RANGE, PRESETS, Preset
from codriver.toml_file import parse_tables, quoted, read_text
from codriver.whole_file import write_text

T = TypeVar("T")
_KEYS = ("name", "source", "ell", "Q", "R")
_EXPECTED = "name, source, ell, Q (four numbers) and R (two numbers), each above 0"


def find_preset(preset: str | Path | Preset) -> Preset:
    """A preset itself, that of a paper by name, or that of a file by its path.

    Raises:
        UsageError: there is no such preset or file, or the file is wrong.
    """
    if isinstance(preset, Preset):
        return preset
    return named_or_file(preset, PRESETS, parse_preset, "", "write one with `codriver tune`")


def named_or_file(
    preset: str | Path, built_in: Mapping[str, T], parse: Callable[[str, str], T], of_what: str, otherwise: str
) -> T:
    """A built-in preset by its name, or that of a file by its path.

    Args:
        preset: name or path.
        built_in: presets by name.
        parse: (text, where) -> preset.
        of_what: for the message: " for a steering torque".
        otherwise: for the message: what to do beside choosing one.

    Raises:
        UsageError: there is neither, or the file is wrong.
    """
    if str(preset) in built_in:
        return built_in[str(preset)]
    path = Path(preset)
    if path.suffix != ".toml" and not path.exists():
        near = nearest(str(preset), built_in)
        raise UsageError(
            f"no preset '{preset}'{of_what}", f"one of {', '.join(built_in)}, or the path of a .toml file",
            f"did you mean {near}?" if near else f"choose one, or {otherwise}",
        )  # fmt: skip
    return parse(read_text(path, "preset", UsageError), str(path))


def parse_preset(text: str, where: str) -> Preset:
    """A preset from the text of a preset file.

    Raises:
        UsageError: listing every fault of the file.
    """
    table = parse_tables(text, where, UsageError)
    faults = [f"'{key}' is not known" for key in table if key not in _KEYS]
    faults += [f"'{key}' is missing" for key in _KEYS if key not in table]
    faults += [f"'{key}' must be a text" for key in ("name", "source") if not isinstance(table.get(key, ""), str)]
    for key, count in (("Q", 4), ("R", 2)):
        values = table.get(key, [1.0] * count)
        if not (isinstance(values, list) and len(values) == count and all(map(_positive, values))):
            faults.append(f"'{key}' must be a list of {count} numbers above 0")
    ell = table.get("ell", 1.0)
    if not (_positive(ell) and ELL_RANGE[0] <= ell <= ELL_RANGE[1]):
        faults.append(f"'ell' must be a number from {ELL_RANGE[0]:g} to {ELL_RANGE[1]:g}")
    if isinstance(table.get("name"), str) and (table["name"] in PRESETS or not table["name"].strip()):
        faults.append(f"the name '{table['name']}' is a paper's, or empty")
    if faults:
        raise UsageError(f"{where}: {'; '.join(faults)}", _EXPECTED, "mend the file, or write it with `codriver tune`")
    q, r = [float(x) for x in table["Q"]], [float(x) for x in table["R"]]
    return Preset((q[0], q[1], q[2], q[3]), (r[0], r[1]), float(ell), table["source"], table["name"])


def save_preset(preset: Preset, path: str | Path) -> None:
    """Write a preset file that `find_preset` reads; it appears under its name only when it is complete.

    Raises:
        UsageError: the name does not end in .toml, the file cannot be written, or it would not be read again.
    """
    text = (
        f"name = {quoted(preset.name)}\nsource = {quoted(preset.source)}\nell = {preset.ell!r}\n"
        "# intensities of v (m^2/s^3), a_i (m^2/s^5), o_a (m^2/s^5), j_i (m^2/s^7)\n"
        f"Q = {list(preset.Q)!r}\n"
        "# of the accelerometer (m^2/s^3) and the speed (m^2/s)\n"
        f"R = {list(preset.R)!r}\n"
    )
    if parse_preset(text, "the preset") != preset:
        raise UsageError(f"the file of '{preset.name}' would be read as another preset", _EXPECTED, "check its numbers")
    write_preset(text, path)


def write_preset(text: str, path: str | Path) -> None:
    """Write the text of a preset's file.

    Raises:
        UsageError: the name does not end in .toml, or the file cannot be written.
    """
    target = Path(path)
    if target.suffix != ".toml":
        raise UsageError(f"cannot write a preset to '{target.name}'", "a name ending in .toml", "choose such a name")
    try:
        write_text(target, text)
    except OSError as error:
        raise UsageError(
            f"cannot write {path}: {error.strerror or error}", "a folder you may write into", "choose another name"
        ) from error


def preset_settings(preset: Preset) -> dict[str, str]:
    """What provenance says of a preset: its name, and the numbers of one's own."""
    if PRESETS.get(preset.name) == preset:
        return {"preset": preset.name}
    return {"preset": preset.name, "preset_Q": _numbers(preset.Q), "preset_R": _numbers(preset.R)}


def preset_of(settings: Mapping[str, str]) -> Preset:
    """The preset that an estimate was made with, from its provenance; its ell is that of the estimate.

    Raises:
        UsageError: the provenance names none, or one that is not known and whose numbers are not there.
    """
    if "preset_Q" not in settings or "preset_R" not in settings:
        return find_preset(settings.get("preset", "none"))
    q, r = ([float(x) for x in settings[f"preset_{key}"].split()] for key in ("Q", "R"))
    return Preset((q[0], q[1], q[2], q[3]), (r[0], r[1]), float(settings["ell"]), "of an estimate", settings["preset"])


def _numbers(values: tuple[float, ...]) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(x)) for x in values)


def _positive(x: Any) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool) and isfinite(x) and x > 0
