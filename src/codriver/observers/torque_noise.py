"""What drives a steering wheel's unknown torque, and what disturbs its encoder: the noise of the driver-torque filters.

    q = T_dr + balance * T_k                        what changes by chance: balance 0, the driver's torque; 1, what is left of it
                                                    when the driver bears all else that acts on the column, T_k
    order 1   q' = torque * w                       a random walk: it changes at any moment
    order 2   q' = s,  s' = torque * w              an integrated one: it runs on as it does
    omega'  = ... + rate * w                        what jolts the wheel beside all torques
    delta'  = omega + slip * w                      what the encoder does beside the wheel: play, a soft column
    y       = delta + angle * n                     n of each sample of the encoder

w is white noise of intensity 1, n has variance 1. `codriver tune driver-torque` and `codriver estimate driver-torque` find them by
maximum likelihood on a record; a file holds them:

    name = "rig"
    source = "fitted on drive.csv"
    order = 1
    balance = 0
    angle = 0.0005     # rad
    slip = 0.0         # rad per sqrt(s)
    rate = 0.01        # rad/s per sqrt(s)
    torque = 8.0       # N m per sqrt(s); at order 2, N m/s per sqrt(s)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

from codriver.errors import UsageError
from codriver.observers.preset_file import named_or_file, write_preset
from codriver.toml_file import parse_tables, quoted

_NUMBERS = ("angle", "slip", "rate", "torque")
_KEYS = ("name", "source", "order", "balance", *_NUMBERS)
_EXPECTED = (
    "name, source, order (1 or 2), balance (0 or 1), angle, slip, rate and torque (numbers; angle and torque above 0)"
)


@dataclass(frozen=True)
class TorqueNoise:
    """The noise.

    Attributes:
        order: of the torque's random walk, 1 or 2.
        angle: standard deviation of a sample of the angle, rad.
        slip: square root of the intensity that moves the angle, rad per sqrt(s).
        rate: of the one that jolts the rate, rad/s per sqrt(s).
        torque: of the one that drives the torque, N m per sqrt(s), or N m/s per sqrt(s) at order 2.
        source, name: where it comes from, and what it is called.
        balance: 0 if the torque itself walks, 1 if its sum with what else acts on the column does.
    """

    order: int
    angle: float
    slip: float
    rate: float
    torque: float
    source: str = "given"
    name: str = "own"
    balance: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            UsageError: see there.
        """
        numbers = (self.angle, self.slip, self.rate, self.torque)
        sizes = all(map(isfinite, numbers)) and min(self.angle, self.torque) > 0 and min(self.slip, self.rate) >= 0
        if self.order not in (1, 2) or self.balance not in (0, 1) or not sizes:
            raise UsageError(f"order {self.order}, balance {self.balance}, noises {numbers}", _EXPECTED, "correct them")

    def settings(self) -> dict[str, str | float]:
        """For provenance."""
        return {
            "preset": self.name, "order": self.order, "balance": self.balance, "angle_noise": self.angle, "slip_noise": self.slip,
            "rate_noise": self.rate, "torque_noise": self.torque,
        }  # fmt: skip


# As simulated drivers and an encoder of 0.1 degree have it: docs/driver-torque.md. A record of one's own gives better ones.
TORQUE_NOISES = {"driver": TorqueNoise(1, 5e-4, 0.0, 0.0, 0.6, "simulated drivers, encoder of 0.1 degree", "driver")}


def find_torque_noise(preset: str | Path | TorqueNoise) -> TorqueNoise:
    """A noise itself, a built-in one by name, or that of a file by its path.

    Raises:
        UsageError: there is no such preset or file, the file is wrong, or it is a preset of another kind.
    """
    if isinstance(preset, TorqueNoise):
        return preset
    if not isinstance(preset, (str, Path)):
        raise UsageError(
            f"a {type(preset).__name__} as the noise of a steering torque",
            "a TorqueNoise, a name or a path",
            "give one",
        )
    otherwise = "none, to have it fitted to the record; `codriver tune driver-torque` writes one"
    return named_or_file(preset, TORQUE_NOISES, parse_torque_noise, " for a steering torque", otherwise)


def parse_torque_noise(text: str, where: str) -> TorqueNoise:
    """A noise from the text of its file.

    Raises:
        UsageError: listing every fault of the file.
    """
    table = parse_tables(text, where, UsageError)
    faults = [f"'{key}' is not known" for key in table if key not in _KEYS]
    faults += [f"'{key}' is missing" for key in _KEYS if key not in table]
    faults += [f"'{key}' must be a text" for key in ("name", "source") if not isinstance(table.get(key, ""), str)]
    faults += [f"'{key}' must be a number" for key in _NUMBERS if not _number(table.get(key, 1.0))]
    for key, allowed in (("order", (1, 2)), ("balance", (0, 1))):
        if isinstance(table.get(key, 1), bool) or table.get(key, 1) not in allowed:
            faults.append(f"'{key}' must be {allowed[0]} or {allowed[1]}")
    faults += [
        f"'{key}' must be above 0" for key in ("angle", "torque") if _number(table.get(key)) and not table[key] > 0
    ]
    faults += [
        f"'{key}' must not be negative" for key in ("slip", "rate") if _number(table.get(key)) and table[key] < 0
    ]
    if isinstance(table.get("name"), str) and (table["name"] in TORQUE_NOISES or not table["name"].strip()):
        faults.append(f"the name '{table['name']}' is a built-in one, or empty")
    if faults:
        raise UsageError(
            f"{where}: {'; '.join(faults)}", _EXPECTED, "mend the file, or write it with `codriver tune driver-torque`"
        )
    angle, slip, rate, torque = (float(table[key]) for key in _NUMBERS)
    return TorqueNoise(
        int(table["order"]), angle, slip, rate, torque, table["source"], table["name"], int(table["balance"])
    )


def save_torque_noise(noise: TorqueNoise, path: str | Path) -> None:
    """Write a file that `find_torque_noise` reads; it appears under its name only when it is complete.

    Raises:
        UsageError: the name does not end in .toml, the file cannot be written, or it would not be read again.
    """
    per = "N m per sqrt(s)" if noise.order == 1 else "N m/s per sqrt(s)"
    text = (
        f"name = {quoted(noise.name)}\nsource = {quoted(noise.source)}\n"
        f"# of the torque's random walk: 1, or 2 for an integrated one\norder = {noise.order}\n"
        "# what walks: 0 the driver's torque, 1 its sum with what else acts on the column\n"
        f"balance = {noise.balance}\n"
        f"angle = {noise.angle!r}  # rad, of a sample\nslip = {noise.slip!r}  # rad per sqrt(s)\n"
        f"rate = {noise.rate!r}  # rad/s per sqrt(s)\n"
        f"torque = {noise.torque!r}  # {per}\n"
    )
    if replace(parse_torque_noise(text, "the preset"), name=noise.name) != noise:
        raise UsageError(f"the file of '{noise.name}' would be read as another one", _EXPECTED, "check its numbers")
    write_preset(text, path)


def _number(x: Any) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool) and isfinite(x)
