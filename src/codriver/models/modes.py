"""The modes of a two-wheeler against speed: roots followed from speed to speed, named, and where they are stable.

    det(s I - A(v)) = 0

The roots s of neighbouring speeds are paired so that they move least (an assignment), on steps fine enough that they cannot be
mistaken. Names are given at one speed, where most roots are complex pairs (its median, if many speeds are alike), and follow the
roots from there:

    wobble       the pair in which steer moves most per roll, where there are two pairs or more: the front end flutters, 6 to 10 Hz
    weave        the slowest pair of the others: roll, yaw and steer together
    rear wobble  other pairs: yaw and lateral motion on the tyres' springs
    capsize      the slowest single root: the machine falls over like a ship
    caster       other single roots: the front end turns into its direction of travel; on tyres, what settles their forces

A pair that meets the real axis stays one mode with two single roots. Where single roots of two modes meet and leave as a pair, the
pair bears both names.

Sharp 1971 (weave, capsize, wobble), doi:10.1243/JMES_JOUR_1971_013_051_02; Meijaard et al. 2007 (caster),
doi:10.1098/rspa.2007.1857, section 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.models.lpv import LPV
from codriver.signals.signal import Array

ORDER = ("weave", "capsize", "wobble", "caster", "rear wobble")
STEP = 0.05  # m/s, the coarsest on which roots are followed
ROOTS = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Modes:
    """Roots by mode.

    Attributes:
        model: whose they are.
        speeds: m/s, shape (k,), increasing.
        roots: 1/s, shape (k, n): a column follows one root.
        names: of the columns.
    """

    model: LPV
    speeds: Array
    roots: ROOTS
    names: tuple[str, ...]

    @property
    def modes(self) -> tuple[str, ...]:
        """The names there are, weave first."""
        return tuple(name for name in ORDER if name in self.names)

    def of(self, name: str) -> ROOTS:
        """Roots of a mode, shape (k, m)."""
        return self.roots[:, [i for i, own in enumerate(self.names) if own == name]]

    def shared(self, k: int) -> dict[int, str]:
        """Columns whose root at speed k makes a pair with a root of another mode, and that mode's name."""
        row = self.roots[k]
        found = {}
        for i in np.flatnonzero(np.abs(row.imag) > _flat(row)):
            partner = int(np.argmin(np.abs(row - row[i].conjugate())))
            if self.names[partner] != self.names[i]:
                found[int(i)] = self.names[partner]
        return found

    def growth(self, name: str | None = None) -> Array:
        """The greatest real part at each speed, 1/s: of a mode, or of all."""
        return np.asarray((self.roots if name is None else self.of(name)).real.max(axis=1))

    def stable_ranges(self, name: str | None = None) -> tuple[tuple[float, float], ...]:
        """Where all real parts are negative, m/s: of a mode, or of all. Ends are found on the model, not on the speeds."""
        growth = self.growth(name)
        inside = growth < 0
        edges = np.flatnonzero(np.diff(inside.astype(int)))
        ends = [self._crossing(int(k), name) for k in edges]
        if inside[0]:
            ends.insert(0, float(self.speeds[0]))
        if inside[-1]:
            ends.append(float(self.speeds[-1]))
        return tuple(zip(ends[::2], ends[1::2], strict=True))

    def _crossing(self, k: int, name: str | None) -> float:
        """The speed between k and k + 1 where the growth is 0."""
        from scipy.optimize import brentq

        low, high = float(self.speeds[k]), float(self.speeds[k + 1])
        own = [i for i, other in enumerate(self.names) if name in (None, other)]
        ends = self.roots[[k, k + 1]][:, own]

        def least_stable(v: float) -> float:
            """Greatest real part of the own roots between the two speeds, told from the others by where they move."""
            share = (v - low) / (high - low)
            roots = np.linalg.eigvals(self.model.A(v))
            expected = (1 - share) * ends[0] + share * ends[1]
            return float(max(roots[np.argmin(np.abs(roots - s))].real for s in expected))

        return float(brentq(least_stable, low, high, xtol=1e-12))


def follow_modes(model: LPV, low: float, high: float, points: int = 401) -> Modes:
    """The modes between two speeds.

    Args:
        model: a two-wheeler, with roll_angle and steer_angle among its states.
        low, high: m/s, low at least 0.
        points: least number of speeds; there are more where steps would be wider than `STEP`.

    Raises:
        ValueError: no such range, or not such a model.
    """
    if not 0 <= low < high < np.inf:
        raise ValueError(f"speeds from {low:g} to {high:g} m/s; a range from at least 0 upwards")
    if not {"roll_angle", "steer_angle"} <= set(model.states):
        raise ValueError(f"states {', '.join(model.states)}; roll_angle and steer_angle must be among them")
    from scipy.optimize import linear_sum_assignment

    speeds = np.linspace(low, high, max(points, int(np.ceil((high - low) / STEP)) + 1))
    each = [np.linalg.eigvals(model.A(v)).astype(complex) for v in speeds]
    roots = np.array(each)
    for k in range(1, speeds.size):
        _, order = linear_sum_assignment(np.abs(roots[k - 1][:, None] - each[k][None, :]))
        roots[k] = each[k][order]
    start = _reference(roots)
    return Modes(model, speeds, roots, _named(model, float(speeds[start]), roots[start]))


def _reference(roots: ROOTS) -> int:
    """The speed at which names are given."""
    pairs = np.array([int((row.imag > _flat(row)).sum()) for row in roots])
    best = np.flatnonzero(pairs == pairs.max())
    return int(best[best.size // 2])


def _flat(row: ROOTS) -> float:
    """Imaginary parts up to here are rounding."""
    return 1e-7 * max(float(np.abs(row).max()), 1e-3)


def _named(model: LPV, speed: float, row: ROOTS) -> tuple[str, ...]:
    """Names of the columns, by the rules of the module's docstring."""
    values, vectors = np.linalg.eig(model.A(speed))
    roll, steer = model.states.index("roll_angle"), model.states.index("steer_angle")
    ratio = {}
    for i, root in enumerate(row):
        shape = np.abs(vectors[:, np.argmin(np.abs(values - root))])
        ratio[i] = float(shape[steer] / max(shape[roll], 1e-300))
    up = [i for i, root in enumerate(row) if root.imag > _flat(row)]
    single = [i for i, root in enumerate(row) if abs(root.imag) <= _flat(row)]
    names = dict.fromkeys(range(row.size), "caster")
    names |= dict.fromkeys(up, "rear wobble")
    wobble = max(up, key=lambda i: ratio[i]) if len(up) > 1 else None
    others = [i for i in up if i != wobble]
    if wobble is not None:
        names[wobble] = "wobble"
    if others:
        names[min(others, key=lambda i: abs(row[i]))] = "weave"
    if single:
        names[min(single, key=lambda i: abs(row[i]))] = "capsize"
    for i in up:
        partner = int(np.argmin(np.abs(row - row[i].conjugate())))
        names[partner] = names[i]
    return tuple(names[i] for i in range(row.size))
