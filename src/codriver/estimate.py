"""What an observer found: signals with standard deviations, validity and provenance; and whether to trust it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from codriver.errors import MissingSignal
from codriver.observers.observer import Output
from codriver.signals import Grid, Log, Signal
from codriver.signals.signal import Array
from codriver.trust import Check, check_estimate
from codriver.trust.innovations import Innovations, innovation_rows


@dataclass(frozen=True, eq=False)
class Estimate(Mapping[str, Signal]):
    """The outputs of an observer over a log.

    As a mapping it holds the outputs by name, as Signals on the observer's tick.

    Attributes:
        observer: its name.
        grid: the sampled inputs.
        columns: of the outputs, by name, shape (n,) each.
        outputs: all outputs of the observer; `columns` lacks those left out when it was compiled.
        measured: standard names of the measurements among the inputs.
        provenance: what made it.
        log: the log it was made from.
    """

    observer: str
    grid: Grid
    columns: Mapping[str, Array]
    outputs: tuple[Output, ...]
    measured: tuple[str, ...]
    provenance: Mapping[str, str]
    log: Log = field(repr=False)

    def __getitem__(self, name: str) -> Signal:
        if name not in self.columns:
            raise MissingSignal(
                f"the estimate has no output '{name}'", f"one of {', '.join(self.columns)}", "correct the name"
            )
        return Signal(name, self.grid.time, self.columns[name], self._output(name).unit, self.observer)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def time(self) -> Array:
        """The ticks, s, shape (n,)."""
        return self.grid.time

    @property
    def estimates(self) -> tuple[Output, ...]:
        """The outputs that are estimates of signals."""
        return tuple(o for o in self.outputs if o.role == "estimate" and o.name in self.columns)

    @property
    def innovations(self) -> list[Innovations]:
        """The rows of innovations among the outputs."""
        return innovation_rows(self.columns, self.outputs)

    def sd(self, name: str) -> Array | None:
        """Standard deviations of an estimate, shape (n,); None where the estimator gives none."""
        return self.columns.get(f"{name}_sd")

    def flag(self, name: str) -> npt.NDArray[np.bool_]:
        """A flag as booleans, shape (n,); all False where the estimator has no such flag."""
        return self.columns[name] > 0.5 if name in self.columns else np.zeros(len(self.grid), bool)

    @property
    def valid(self) -> npt.NDArray[np.bool_]:
        """Where the model holds, the inputs are known and the estimate has settled, shape (n,).

        All True where the observer has no flag `valid`: it claims to be valid always.

        Raises:
            MissingSignal: the observer has the flag, but it was left out of the outputs.
        """
        if "valid" in self.columns:
            return self.flag("valid")
        if any(output.name == "valid" for output in self.outputs):
            raise MissingSignal(
                f"where {self.observer} is valid is not known: the flag 'valid' was left out of the outputs",
                "an estimate with it", "add 'valid' to the outputs given to compile()",
            )  # fmt: skip
        return np.ones(len(self.grid), bool)

    @property
    def faults(self) -> tuple[str, ...]:
        """What was wrong with the recording."""
        return self.log.faults

    def check(self) -> Check:
        """Whether to trust the estimate: what the innovations and the flags say.

        Outputs that were left out are not judged, and named.
        """
        return check_estimate(self.columns, self.outputs, self.grid, self.measured, self.log, self._knob())

    def _knob(self) -> float | None:
        """The setting ell, where the observer has one that is a number above 0."""
        try:
            ell = float(self.provenance["ell"])
        except (KeyError, ValueError):
            return None
        return ell if 0 < ell < float("inf") else None

    def _output(self, name: str) -> Output:
        return next(o for o in self.outputs if o.name == name)
