"""CAN frames as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

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

    def where(self, which: npt.NDArray[np.bool_] | npt.NDArray[np.signedinteger]) -> Frames:
        """The frames for which the flag is set, shape (n,), or those of the places given, in their order."""
        return Frames(*(getattr(self, column.name)[which] for column in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Frames]) -> Frames:
        """The frames of several parts, one behind the other; the wider data gives the width."""
        width = max((part.data.shape[1] for part in parts), default=8)
        data = np.zeros((sum(map(len, parts)), width), np.uint8)
        start = 0
        for part in parts:
            data[start : start + len(part), : part.data.shape[1]] = part.data
            start += len(part)
        types = (np.float64, np.int16, np.uint32, np.bool_, np.uint8)
        columns: dict[str, Any] = {
            column.name: np.concatenate([np.zeros(0, dtype), *(getattr(part, column.name) for part in parts)])
            for column, dtype in zip(fields(cls)[:-1], types, strict=True)
        }
        return cls(**columns, data=data)
