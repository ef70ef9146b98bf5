"""The parameters of a two-point driver from a drive, with standard errors, and refusals by name.

    by "road"       the road as instrument (`driver_road`): for drivers who vary, as people do
    by "direct"     prediction errors, the least squares of `driver_search`: sharper, and right only for a driver who is always the
                    same (Ljung, System Identification, 2nd ed. 1999, chapter 13, on direct identification in closed loop)

What is known of drivers before the drive counts as one more observation: each parameter's logarithm is normal about the known
driver's with SPREAD, a factor of 1.6 either way. So a parameter that the drive hardly tells is not held at a value that may be
wrong: its doubt is in the intervals of all others. Intervals are even in the logarithm.

Refused by name is a parameter of a combination that does not show in T at one speed, as K_r with K_p, K_c and K_t, and one whose
standard error the drive has not brought below TOLD of what it was before, or that is STRANGE spreads from what was known without
being SHARP: gains that drift by a tenth and more pull K_t down by the road, since K_r v d is nearly all of the torque of a steady
curve.

Measured on the circuit, 8 laps, 5 drivers, 3 seeds each, known = the default driver: see docs/two-point.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.identify.brake_fit import Refusal
from codriver.identify.driver_record import DriverRecord, driver_record
from codriver.identify.driver_residual import driver_of, jacobian, residual_of, thinning
from codriver.identify.driver_result import LETTERS, DriverFit, DriverParameter
from codriver.identify.driver_road import by_the_road
from codriver.identify.driver_search import Found, search
from codriver.models.two_point import TwoPointDriver
from codriver.signals import Log
from codriver.signals.signal import Array

ASKED = ("anticipation", "compensation", "lead", "lag", "delay", "reflex", "muscle")
WAYS = ("road", "direct")
SPREAD = 0.5
TOLD = 0.6
STRANGE, SHARP = 2.0, 0.2  # spreads from what was known, with this share of doubt left
CONFUSED = 0.5  # correlation of two estimates that is worth a word
HIDDEN = 1e-6  # a singular value of the scaled Jacobian below this share of the greatest is none


def identify_driver(
    log: Log,
    known: TwoPointDriver | None = None,
    *,
    asked: Sequence[str] = ASKED,
    by: str = "road",
    spread: float = SPREAD,
) -> DriverFit:
    """Identify a driver.

    Args:
        log: a drive at one speed, see `driver_record`.
        known: where the two points are, the parameters that are not asked for, and what is known of the others. K_r is among the
            former: K_p and K_c are those for this K_r.
        asked: names of the parameters to identify.
        by: "road" or "direct".
        spread: standard deviation of the logarithms of the parameters asked for about those known.

    Raises:
        MissingSignal, LogError: see `driver_record`; or nothing happens in the drive.
        UsageError: a name is no parameter, or is asked for twice; there is no such way; the spread is not positive.
    """
    known = known or TwoPointDriver()
    if by not in WAYS or not spread > 0:
        raise UsageError(
            f"by '{by}', spread {spread:g}", f"one of {', '.join(WAYS)}, and a positive spread", "choose one"
        )
    if not asked or len(set(asked)) < len(asked) or any(n not in LETTERS for n in asked):
        raise UsageError(
            f"asked for {', '.join(asked) or 'nothing'}", f"some of {', '.join(LETTERS)}, each once", "choose among these"
        )  # fmt: skip
    record = driver_record(log, known.near, known.far)
    _refuse_rest(record)
    hidden = _hidden(record, known, tuple(asked))
    names = tuple(n for n in asked if n not in hidden)
    refused = [Refusal(n, _together(n, hidden)) for n in asked if n in hidden]
    if not names:
        return _result(record, known, names, None, refused, tuple(asked), by, spread)
    residual = residual_of(record, known, names)
    instrument = residual_of(by_the_road(record), known, names) if by == "road" else residual
    end = search(residual, instrument, _logarithms(known, names), spread)
    return _result(record, known, names, end, refused, tuple(asked), by, spread)


def _logarithms(known: TwoPointDriver, names: tuple[str, ...]) -> Array:
    return np.log([max(getattr(known, n), 1e-3) for n in names])


def _refuse_rest(record: DriverRecord) -> None:
    """A drive in which nothing happens tells nothing."""
    rows = slice(record.first, record.last)
    seen, torque = float(np.std(record.far[rows])), float(np.std(record.torque[rows]))
    if float(np.std(record.curvature[rows])) < 1e-5 or torque < 1e-3:
        raise LogError(
            f"{record.source}: a far point that moves by {seen:.2g} rad and a torque that changes by {torque:.2g} N m (sd)",
            "a drive with curves, and a torque that was measured or estimated",
            "record such a drive",
        )


def _hidden(record: DriverRecord, known: TwoPointDriver, names: tuple[str, ...]) -> set[str]:
    """Parameters of the combinations that do not show in the torque of this drive."""
    J = jacobian(residual_of(record, known, names), _logarithms(known, names))
    scale = np.linalg.norm(J, axis=0)
    silent = {n for n, s in zip(names, scale, strict=True) if s < 1e-9 * scale.max()}
    shown = [k for k, n in enumerate(names) if n not in silent]
    _, s, V = np.linalg.svd(J[:, shown] / scale[shown], full_matrices=False)
    return silent | {
        names[k] for row in V[s < HIDDEN * s[0]] for k, share in zip(shown, row, strict=True) if abs(share) > 0.05
    }


def _together(name: str, hidden: set[str]) -> str:
    others = ", ".join(sorted(hidden - {name}))
    if not others:
        return "it does not show in the torque"
    return f"only a combination of it with {others} shows in the torque at one speed"


def _vague(names: tuple[str, ...], k: int, sd: float, spread: float, correlation: Array) -> str:
    """Why a parameter is refused, and what it is confused with."""
    said = f"this drive hardly tells it: {100 * sd:.0f} % of doubt, of {100 * spread:.0f} % before"
    others = np.abs(np.where(np.arange(len(names)) == k, 0.0, correlation[k]))
    rival = int(np.argmax(others))
    if others[rival] < CONFUSED:
        return said
    return f"{said}; confused with {names[rival]} (correlation {correlation[k, rival]:.2f})"


def _result(
    record: DriverRecord, known: TwoPointDriver, names: tuple[str, ...], end: Found | None, refused: list[Refusal],
    asked: tuple[str, ...], by: str, spread: float,
) -> DriverFit:  # fmt: skip
    """Parameters with intervals, refusals, and how well it fits."""
    parameters: dict[str, DriverParameter] = {}
    best, correlation, one_step = known, np.zeros((0, 0)), float("nan")
    if end is not None:
        best, sd = driver_of(known, names, end.theta), np.sqrt(np.stack([end.plain.diagonal(), end.robust.diagonal()]))
        correlation = end.robust / np.outer(sd[1], sd[1])
        one_step = float(np.sqrt(np.mean(end.errors**2)))
        for k, name in enumerate(names):
            value, wide = float(np.exp(end.theta[k])), float(sd[:, k].max())
            off = abs(float(end.theta[k] - _logarithms(known, names)[k])) / spread
            if wide > TOLD * spread:
                refused = [*refused, Refusal(name, _vague(names, k, wide, spread, correlation))]
                continue
            if off > STRANGE and wide > SHARP * spread:
                said = f"{value:.3g} {LETTERS[name][1]} is {off:.1f} spreads from what was known, and not sharp"
                refused = [*refused, Refusal(name, f"{said}: gains that drift do so")]
                continue
            low, high = (value * np.exp([-1.96 * wide, 1.96 * wide])).tolist()
            plain, robust = (value * sd[:, k]).tolist()
            parameters[name] = DriverParameter(name, *LETTERS[name], value, value * wide, plain, robust, low, high)
    rows = slice(record.first, record.last)
    torque = record.torque[rows]
    left = torque - best.torque(record.near, record.far, record.angle, record.speed, record.dt)[rows]
    return DriverFit(
        parameters, tuple(refused), {n: getattr(known, n) for n in (*LETTERS, "near", "far") if n not in asked}, correlation,
        names, by, end is None or end.settled, best, float(left.std()), float(1 - left.var() / torque.var()), one_step,
        thinning(record.dt) * record.dt, torque.size * record.dt, record.speed, record,
    )  # fmt: skip
