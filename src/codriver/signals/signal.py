"""One quantity on its own clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Signal:
    """One quantity on its own clock, with its unit and source. Never changed in place.

    Attributes:
        name: standard name, or the source's own name where there is no standard one.
        time: stamps, s, shape (n,), not decreasing; others are refused, since sampling searches them.
        values: shape (n,), in `unit`; NaN where the source had no number.
        unit: SI unit for standard names.
        source: where it came from ("EngineData.Torque"), for people.
    """

    name: str
    time: Array
    values: Array
    unit: str
    source: str = ""

    def __post_init__(self) -> None:
        for field in ("time", "values"):
            # A view: the caller's own array keeps its flags.
            array = np.ascontiguousarray(getattr(self, field), dtype=np.float64).view()
            array.flags.writeable = False
            object.__setattr__(self, field, array)
        if self.time.shape != self.values.shape or self.time.ndim != 1:
            raise ValueError(
                f"{self.name}: time {self.time.shape} and values {self.values.shape} must be equal vectors"
            )
        step = self.time[1:] >= self.time[:-1]  # False for stamps that are not numbers, too
        if not step.all():
            at = int(np.argmin(step))
            raise ValueError(
                f"{self.name}: stamp {at + 1} is {self.time[at + 1]:.10g} s, after {self.time[at]:.10g} s; stamps must be numbers "
                "that do not decrease: sort them, or read the recording with codriver.read, which mends its clocks"
            )

    def __len__(self) -> int:
        return self.time.size

    @property
    def rate(self) -> float:
        """Samples per second, from the median interval; NaN for fewer than two samples."""
        if self.time.size < 2:
            return float("nan")
        step = float(np.median(np.diff(self.time)))
        return 1.0 / step if step > 0 else float("nan")

    @property
    def duration(self) -> float:
        """Last stamp less first stamp, s."""
        return float(self.time[-1] - self.time[0]) if self.time.size else 0.0

    def between(self, start: float, stop: float) -> Signal:
        """The part with start <= time < stop."""
        i, k = np.searchsorted(self.time, [start, stop])
        return Signal(self.name, self.time[i:k], self.values[i:k], self.unit, self.source)

    def to_dict(self) -> dict[str, Any]:
        """What a listing says of the signal."""
        finite = self.values[np.isfinite(self.values)]
        return {
            "name": self.name,
            "unit": self.unit,
            "source": self.source,
            "samples": int(self.time.size),
            "rate_hz": round(self.rate, 3) if self.time.size > 1 else None,
            "from_s": float(self.time[0]) if self.time.size else None,
            "to_s": float(self.time[-1]) if self.time.size else None,
            "minimum": float(finite.min()) if finite.size else None,
            "maximum": float(finite.max()) if finite.size else None,
            "missing": int(self.values.size - finite.size),
        }
