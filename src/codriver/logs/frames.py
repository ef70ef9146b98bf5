"""CAN frames as columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Frames:
    """CAN data frames as columns; error and remote frames are left out by the reader.

    Attributes:
        time: s, float64, shape (n,), as the trace has it.
        bus: channel number as the trace has it, int16, shape (n,).
        identifier: 11 or 29 bits, without the extended flag, uint32, shape (n,).
        extended: True for 29-bit identifiers, shape (n,).
        length: payload bytes, uint8, shape (n,).
        data: payload, uint8, shape (n, 8) or (n, 64), zero behind `length`.
    """

    time: npt.NDArray[np.float64]
    bus: npt.NDArray[np.int16]
    identifier: npt.NDArray[np.uint32]
    extended: npt.NDArray[np.bool_]
    length: npt.NDArray[np.uint8]
    data: npt.NDArray[np.uint8]

    def __len__(self) -> int:
        return self.time.size
