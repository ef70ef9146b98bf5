"""The innovations of an observer: measured less predicted, row by row, and how large they are against their band.

A row is an output of role "innovation". Its name is the output's without "_innovation"; its standard deviation is the
output "<name>_innovation_sd", and "<name>_used" is 1 on the ticks on which a measurement of it was used (without that
flag: on every tick). Of the normalised innovations n = e / sd(e), over the ticks that count:

    scatter^2 = mean of n^2                                  1 if they are as large as they claim
    lean^2    = mean over blocks of (sum n)^2 / (number)     1 if they are white, more if they lean to one side
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.observers.observer import Output
from codriver.signals.signal import Array

SUFFIX = "_innovation"


@dataclass(frozen=True, eq=False)
class Innovations:
    """One row.

    Attributes:
        row: its name.
        values: measured less predicted, shape (n,).
        sd: what the observer expects of them, shape (n,); None where it does not say.
        used: where a measurement was used, shape (n,).
    """

    row: str
    values: Array
    sd: Array | None
    used: npt.NDArray[np.bool_]

    @property
    def sound(self) -> npt.NDArray[np.bool_]:
        """Where there is a finite innovation with a standard deviation above zero, shape (n,)."""
        if self.sd is None:
            return np.zeros(self.values.size, bool)
        return self.used & np.isfinite(self.values) & np.isfinite(self.sd) & (self.sd > 0)

    def normalised(self, rest: float = 0.0) -> Array:
        """e / sd(e) where it is sound, `rest` elsewhere, shape (n,)."""
        sound, normal = self.sound, np.full(self.values.size, rest)
        if self.sd is not None:
            normal[sound] = self.values[sound] / self.sd[sound]
        return normal


def row_name(output: Output) -> str:
    """The name of the row that an output of role "innovation" is of."""
    return output.name.removesuffix(SUFFIX)


def innovation_rows(values: Mapping[str, Array], outputs: Iterable[Output]) -> list[Innovations]:
    """The rows among an observer's outputs, in their order; rows that were left out of the values are not there."""
    rows = []
    for output in outputs:
        if output.role == "innovation" and output.name in values:
            row, column = row_name(output), values[output.name]
            flag = values.get(f"{row}_used")
            used = np.ones(column.size, bool) if flag is None else flag > 0.5
            rows.append(Innovations(row, column, values.get(f"{output.name}_sd"), used))
    return rows


def blocks(normal: Array, counted: npt.NDArray[np.bool_], length: int) -> tuple[Array, Array, Array]:
    """Blocks of `length` ticks: mean square of the normalised innovations that count, the square of their sum over their
    number (1 if white), and that number."""
    starts = np.arange(0, normal.size, length)
    chosen = np.where(counted, normal, 0.0)
    count = np.add.reduceat(counted.astype(float), starts)
    some = np.maximum(count, 1)
    return np.add.reduceat(chosen**2, starts) / some, np.add.reduceat(chosen, starts) ** 2 / some, count
