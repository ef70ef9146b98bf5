"""Which drives a driver learnt from, so that figures on one of them are not taken for figures on a new drive.

    T_1, T_2, ...            the torque's values wherever it changes, as float32
    h_k = mix(T_k, ..., T_k+7)       64 bits                  print: the 32 least h_k of a drive

Windows of eight values of a sensor with noise hardly ever come twice, and neither the clock nor where a recording was cut is in
them. Of a part, its share of the print is found again; two of the 32 are enough.

Broder 1997, doi:10.1109/SEQUEN.1997.666900 (resemblance by least hashes).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from codriver.signals import Signal

WINDOW, KEPT, ENOUGH = 8, 32, 2

Hashes = npt.NDArray[np.uint64]


def fingerprint(torque: Signal) -> list[str]:
    """The print of a drive: at most KEPT numbers in hexadecimal."""
    return [f"{int(h):016x}" for h in np.unique(_hashes(torque))[:KEPT]]


def learnt_from(torque: Signal, prints: Iterable[Sequence[str]]) -> bool:
    """Whether a drive, or a part of it, is one of those whose prints are given."""
    mine = {f"{int(h):016x}" for h in _hashes(torque)}
    return any(sum(h in mine for h in one) >= ENOUGH for one in prints)


def _hashes(torque: Signal) -> Hashes:
    """A number for every window of values."""
    values = torque.values[np.isfinite(torque.values)].astype(np.float32)
    values = values[np.flatnonzero(np.diff(values, prepend=np.nan) != 0)] + np.float32(0)  # -0 is 0
    if values.size < WINDOW:
        return np.empty(0, np.uint64)
    bits = values.view(np.uint32).astype(np.uint64)
    made = np.zeros(bits.size - WINDOW + 1, np.uint64)
    for k in range(WINDOW):
        made = _mixed(made ^ bits[k : k + made.size])
    return made


def _mixed(x: Hashes) -> Hashes:
    """A one-to-one scrambling of 64 bits (splitmix64)."""
    x = x + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))
