"""The parameters of a two-point driver from drives, with standard errors, and refusals by name.

    by "road"       the road as instrument (`driver_road`): for drivers who vary, as people do
    by "direct"     prediction errors, the least squares of `driver_search`: sharper, and right only for a driver who is always the
                    same (Ljung, System Identification, 2nd ed. 1999, chapter 13, on direct identification in closed loop)
    by "dual-ekf"   tick by tick (`driver_dual_ekf`), as Okamoto, Tsiotras 2019, section 5.3: for comparison

What is known of drivers before the drive counts as one more observation: each parameter's logarithm is normal about the known
driver's with SPREAD, a factor of 1.6 either way. So a parameter that the drive hardly tells is not held at a value that may be
wrong: its doubt is in the intervals of all others. Intervals are even in the logarithm.

Refused by name is a parameter of a combination that does not show in T at one speed, as K_r with K_p, K_c and K_t, and one whose
standard error the drive has not brought below TOLD of what it was before, or that is STRANGE spreads from what was known without
being SHARP: gains that drift by a tenth and more pull K_t down by the road, since K_r v d is nearly all of the torque of a steady
curve. Several drives count together, each at a speed of its own; at two speeds K_r shows.

Measured on the circuit, 8 laps, 5 drivers, 3 seeds each, known = the default driver: see docs/two-point.md.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.identify.brake_fit import Refusal
from codriver.identify.driver_dual_ekf import DualFit, DualTuning, dual_ekf
from codriver.identify.driver_holes import holes_told
from codriver.identify.driver_pieces import DrivePieces, drive_pieces
from codriver.identify.driver_record import DriverRecord
from codriver.identify.driver_residual import driver_of, jacobian, residual_of, thinning
from codriver.identify.driver_result import DriverFit, DriverParameter
from codriver.identify.driver_road import by_the_road
from codriver.identify.driver_search import Found, search
from codriver.models.two_point import TwoPointDriver
from codriver.models.two_point_file import LETTERS
from codriver.signals import Log
from codriver.signals.signal import Array

ASKED = ("anticipation", "compensation", "lead", "lag", "delay", "reflex", "muscle")
SEEN = ("near", "far")  # where he looks: sought only if asked for, since it takes much of what a drive tells
WAYS = ("road", "direct", "dual-ekf")
TWO_SPEEDS = 1.1  # ratio
SPREAD = 0.5
TOLD = 0.6
STRANGE, SHARP = 2.0, 0.2  # spreads from what was known, with this share of doubt left
CONFUSED = 0.5  # correlation of two estimates that is worth a word
HIDDEN = 1e-6  # a singular value of the scaled Jacobian below this share of the greatest is none


def identify_driver(
    drives: Log | Sequence[Log],
    known: TwoPointDriver | None = None,
    *,
    asked: Sequence[str] | None = None,
    held: Collection[str] = (),
    also: Collection[str] = (),
    by: str = "road",
    spread: float = SPREAD,
) -> DriverFit:
    """Identify a driver.

    Args:
        drives: one or several, each at one speed, see `driver_record`; one with holes is cut there (`driver_pieces`).
        known: where the two points are, the parameters that are not asked for, and what is known of the others. K_r is among the
            former: K_p and K_c are those for this K_r.
        asked: names of the parameters to identify; None for all of ASKED, and K_r where the drives' speeds differ by a tenth.
        held: names of the parameters that None leaves out, since they are known.
        also: names that are sought beside: "near" and "far", where he looks. The dual filter cannot.
        by: "road", "direct" or "dual-ekf"; the last takes one drive.
        spread: standard deviation of the logarithms of the parameters asked for about those known.

    Raises:
        MissingSignal, LogError: see `drive_pieces`; or the dual filter diverges, or has a drive of several pieces.
        UsageError: a name is no parameter, or is asked for twice; there is no such way; the spread is not positive; no drive, or
            too many.
    """
    known = known or TwoPointDriver()
    logs = [drives] if isinstance(drives, Log) else list(drives)
    if by not in WAYS or not spread > 0:
        raise UsageError(
            f"by '{by}', spread {spread:g}", f"one of {', '.join(WAYS)}, and a positive spread", "choose one"
        )
    seekable = [n for n in LETTERS if by != "dual-ekf" or n not in SEEN]
    if any(n not in seekable for n in also):
        raise UsageError(f"{', '.join(also)} by '{by}'", f"some of {', '.join(seekable)}", "choose among these")
    if asked is not None and (not asked or len(set(asked)) < len(asked) or any(n not in seekable for n in asked)):
        raise UsageError(
            f"asked for {', '.join(asked) or 'nothing'}", f"some of {', '.join(seekable)}, each once", "choose among these"
        )  # fmt: skip
    if not logs or (by == "dual-ekf" and len(logs) > 1):
        raise UsageError(f"{len(logs)} drives", "one drive" + (" or several" if by != "dual-ekf" else ""), "say which")
    taken = tuple(drive_pieces(log, known.near, known.far) for log in logs)
    records = tuple(r for drive in taken for r in drive.records)
    if by == "dual-ekf":
        _refuse_pieces(taken[0])
    if asked is None:
        asked = [n for n in dict.fromkeys((*ASKED, *_at_two_speeds(records), *also)) if n not in held]
        if not asked:
            raise UsageError("every parameter is held", f"some of {', '.join(ASKED)} to be sought", "hold fewer")
    hidden = _hidden(records, known, tuple(asked))
    names = tuple(n for n in asked if n not in hidden)
    end, path = None, None
    if names and by == "dual-ekf":
        end, path = _by_filter(records[0], known, names, spread)
    elif names:
        residual = residual_of(records, known, names)
        instrument = residual_of([by_the_road(r) for r in records], known, names) if by == "road" else residual
        end = search(residual, instrument, _logarithms(known, names), spread)
    parameters, refused = _judged(known, names, end, spread)
    refused = (*(Refusal(n, _together(n, hidden, len(logs))) for n in asked if n in hidden), *refused)
    best = known if end is None else driver_of(known, names, end.theta)
    rms, explained = _left(records, best)
    return DriverFit(
        parameters, refused, {n: float(getattr(known, n)) for n in LETTERS if n not in asked}, known,
        np.zeros((0, 0)) if end is None else _correlation(end), names, by, end is None or end.settled, best, rms, explained,
        float("nan") if end is None else float(np.sqrt(np.mean(end.errors**2))),
        path.tick if path is not None else thinning(records[0].dt) * records[0].dt, end,
        float(sum((r.last - r.first) * r.dt for r in records)), tuple(r.speed for r in records), taken, records, path,
        tuple(log["driver_torque"].source for log in logs if log["driver_torque"].source.startswith("estimate")),
    )  # fmt: skip


def _by_filter(
    record: DriverRecord, known: TwoPointDriver, names: tuple[str, ...], spread: float
) -> tuple[Found, DualFit]:
    """The dual filter's end as that of a search, and its path."""
    path = dual_ekf(record, known, names, DualTuning(spread=spread))
    variance = path.covariance.diagonal()
    if not (np.isfinite(path.values).all() and (variance > 0).all()):
        raise LogError(
            f"{record.source}: the dual filter diverges", "a filter that stays finite", "identify by the road"
        )
    late = np.log(path.values[-path.time.size // 5 :])
    settled = bool((np.ptp(late, axis=0) < np.sqrt(variance)).all())
    pieces = np.array([0, path.errors.size])
    return Found(np.log(path.values[-1]), settled, path.covariance, path.covariance, path.errors, pieces), path


def _at_two_speeds(records: Sequence[DriverRecord]) -> tuple[str, ...]:
    """What only drives at two speeds tell."""
    speeds = [r.speed for r in records]
    return ("column_gain",) if max(speeds) > TWO_SPEEDS * min(speeds) else ()


def _logarithms(known: TwoPointDriver, names: tuple[str, ...]) -> Array:
    return np.log([max(getattr(known, n), 1e-3) for n in names])


def _refuse_pieces(drive: DrivePieces) -> None:
    """The dual filter goes through one stretch."""
    if len(drive.records) > 1:
        raise LogError(
            f"{drive.source}: {holes_told(drive.holes)}",
            "a drive without holes: the dual filter goes tick by tick",
            "identify by the road, which takes the pieces together, or cut the log to one of them",
        )


def _hidden(records: Sequence[DriverRecord], known: TwoPointDriver, names: tuple[str, ...]) -> set[str]:
    """Parameters of the combinations that do not show in the torque of these drives."""
    J = np.concatenate(jacobian(residual_of(records, known, names), _logarithms(known, names)))
    scale = np.linalg.norm(J, axis=0)
    silent = {n for n, s in zip(names, scale, strict=True) if s < 1e-9 * scale.max()}
    shown = [k for k, n in enumerate(names) if n not in silent]
    _, s, V = np.linalg.svd(J[:, shown] / scale[shown], full_matrices=False)
    return silent | {
        names[k] for row in V[s < HIDDEN * s[0]] for k, share in zip(shown, row, strict=True) if abs(share) > 0.05
    }


def _left(records: Sequence[DriverRecord], best: TwoPointDriver) -> tuple[float, float]:
    """RMS of the torque that a driver's model leaves unexplained, about its mean in each drive, and the share that it explains."""
    left = whole = rows = 0.0
    for r in records:
        use = slice(r.first, r.last)
        torque = r.torque[use]
        off = torque - best.torque(*r.seen(best.near, best.far), r.angle, r.speed, r.dt)[use]
        left, whole, rows = left + torque.size * off.var(), whole + torque.size * torque.var(), rows + torque.size
    return float(np.sqrt(left / rows)), float(1 - left / whole)


def _correlation(end: Found) -> Array:
    sd = np.sqrt(end.robust.diagonal())
    return np.asarray(end.robust / np.outer(sd, sd))


def _together(name: str, hidden: set[str], drives: int) -> str:
    others = ", ".join(sorted(hidden - {name}))
    if not others:
        return "it does not show in the torque"
    return f"only a combination of it with {others} shows in the torque at one speed" + (
        "" if drives == 1 else ", and these drives are at one"
    )


def _vague(names: tuple[str, ...], k: int, sd: float, spread: float, correlation: Array) -> str:
    """Why a parameter is refused, and what it is confused with."""
    said = f"this drive hardly tells it: {100 * sd:.0f} % of doubt, of {100 * spread:.0f} % before"
    others = np.abs(np.where(np.arange(len(names)) == k, 0.0, correlation[k]))
    rival = int(np.argmax(others))
    if others[rival] < CONFUSED:
        return said
    return f"{said}; confused with {names[rival]} (correlation {correlation[k, rival]:.2f})"


def _judged(
    known: TwoPointDriver, names: tuple[str, ...], end: Found | None, spread: float
) -> tuple[dict[str, DriverParameter], tuple[Refusal, ...]]:
    """Parameters with intervals, and those that the drives do not tell."""
    if end is None:
        return {}, ()
    parameters: dict[str, DriverParameter] = {}
    refused: list[Refusal] = []
    sd = np.sqrt(np.stack([end.plain.diagonal(), end.robust.diagonal()]))
    for k, name in enumerate(names):
        value, wide = float(np.exp(end.theta[k])), float(sd[:, k].max())
        off = abs(float(end.theta[k] - _logarithms(known, names)[k])) / spread
        letter, unit = LETTERS[name]
        if wide > TOLD * spread:
            refused.append(Refusal(name, _vague(names, k, wide, spread, _correlation(end))))
        elif off > STRANGE and wide > SHARP * spread:
            said = f"{value:.3g} {unit} is {off:.1f} spreads from what was known, and not sharp"
            refused.append(Refusal(name, f"{said}: gains that drift do so"))
        else:
            low, high = (value * np.exp([-1.96 * wide, 1.96 * wide])).tolist()
            plain, robust = (value * sd[:, k]).tolist()
            parameters[name] = DriverParameter(name, letter, unit, value, value * wide, plain, robust, low, high)
    return parameters, tuple(refused)
