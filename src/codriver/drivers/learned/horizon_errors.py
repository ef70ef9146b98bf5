"""What was foretold at several horizons, and how wrong it was: by form and kind of model, part by part.

RMSE(h) over all rows held out          s.e.(h) = sd over the parts of RMSE(h) / sqrt(parts)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from codriver.drivers.learned.features import Index
from codriver.finding import Finding
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

NAIVE = ("pwc", "pwl")  # the torque stays, its slope stays


@dataclass(frozen=True, eq=False)
class HorizonErrors:
    """Torques foretold at m horizons from n moments, each by a model that had not seen that part.

    Attributes:
        horizons: s, shape (m,).
        time: of each moment, s; drive, part: numbers; shape (n,).
        now: torque at that moment, N m, shape (n,).
        truth: torque h later, N m, shape (n, m).
        made: by form and kind, N m, shape (n, m); NAIVE among the direct ones; no "iterated" without a vehicle.
        beyond: by kind, whether the rollout has passed a bound by then, shape (n, m).
        inside: by kind, whether the torque is in the direct form's calibrated 95 % band, shape (n, m).
        folds: names of the parts held out in turn.
        road: how far ahead the road is known at the last horizon, s at the present speed; 0 without a road.
        target: the torque's name.
        left_out: signals that the drives lack.
        estimated: whether the torque is an estimate.
    """

    horizons: Array
    time: Array
    drive: Index
    part: Index
    now: Array
    truth: Array
    made: Mapping[tuple[str, str], Array]
    beyond: Mapping[str, Flags]
    inside: Mapping[str, Flags]
    folds: tuple[str, ...]
    road: float
    target: str
    left_out: tuple[str, ...] = ()
    estimated: bool = False

    @property
    def rows(self) -> int:
        """Moments judged."""
        return self.time.size

    @property
    def direct(self) -> dict[str, Array]:
        """RMSE by kind, N m, shape (m,)."""
        return self._of("direct")

    @property
    def iterated(self) -> dict[str, Array]:
        """RMSE by kind, N m, shape (m,)."""
        return self._of("iterated")

    @property
    def diverged(self) -> dict[str, Array]:
        """By kind, share of the rollouts that have passed a bound by then, shape (m,); they count in `iterated`."""
        return {kind: flags.mean(axis=0) for kind, flags in self.beyond.items()}

    @property
    def coverage(self) -> dict[str, Array]:
        """By kind, share of the moments inside the direct form's 95 % band, shape (m,)."""
        return {kind: flags.mean(axis=0) for kind, flags in self.inside.items()}

    def rmse(self, form: str, kind: str) -> Array:
        """Over all rows, N m, shape (m,)."""
        return np.sqrt(np.mean((self.truth - self.made[form, kind]) ** 2, axis=0))

    def parts(self, form: str, kind: str) -> Array:
        """RMSE of each part, N m, shape (folds, m)."""
        squares = (self.truth - self.made[form, kind]) ** 2
        return np.sqrt([squares[self.part == k].mean(axis=0) for k in range(len(self.folds))])

    def spread(self, form: str, kind: str) -> Array:
        """Standard error of the RMSE from its scatter over the parts, N m, shape (m,); NaN with one part."""
        each = self.parts(form, kind)
        if len(each) < 2:
            return np.full(self.horizons.size, np.nan)
        return np.asarray(each.std(axis=0, ddof=1) / np.sqrt(len(each)))

    def verdict(self) -> list[Finding]:
        """What can be said at the last horizon."""
        h, stays = self.horizons[-1], self.direct["pwc"][-1]
        found = [Finding("warn", "the torque is itself an estimate from the wheel's angle")] if self.estimated else []
        for kind, errors in self.direct.items():
            if kind not in NAIVE:
                found.append(_against(f"{kind}, {h:g} s ahead directly", errors[-1], stays))
        for kind, errors in self.iterated.items():
            found.append(_against(f"{kind}, iterated to {h:g} s", errors[-1], stays))
            lost = int(self.beyond[kind][:, -1].sum())
            if lost:
                text = f"{lost} of {kind}'s {self.rows} rollouts diverge within {h:g} s and are held at a bound"
                found.append(Finding("warn", text))
        return found

    def _of(self, form: str) -> dict[str, Array]:
        return {kind: self.rmse(form, kind) for own, kind in self.made if own == form}


def _against(who: str, error: float, stays: float) -> Finding:
    said = f"{who}: RMSE {error:.3f} N m, {error / stays:.2f} times that of the torque that stays"
    return Finding("ok" if error < stays else "bad", said)
