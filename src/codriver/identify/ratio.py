"""tau / M by gear, from drives with the brake released.

2017 eq. (19) per unit of mass, where p_b = 0:

    [y1]_F = sum over gears g of (tau_g/M) [T_e 1_g]_F - k_1 - k_2 [v^2]_F

is linear in tau_g/M (1/(kg m)), k_1 (m/s^2; one a log, holds the accelerometer's bias too) and k_2 (1/m). All signals pass the
same first-order low-pass of 5 Hz. k_2 is only fitted where the drive covers enough speeds to tell it. A log without a gear
signal is taken for a car of one gear.

A body that pitches shows more acceleration than the car has, y1 = (1 + gamma) dv/dt + g sin(slope), and tau/M would come out
larger by gamma (usual: 1 to 2 %). Where the road is not level, dv/dt from the wheels is no combination of the columns above,
and as one more column it tells gamma. On a level road it does not, and the ratio holds gamma.

Where the log has the engine's speed omega, tau / eta = omega / v in a gear with the clutch closed: a second opinion on tau that
knows nothing of torque and mass, up to the efficiency eta of 0.8 to 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.finding import Finding
from codriver.identify.brake_rows import SIGNALS, DriveRows, drive_rows, short_name
from codriver.identify.gear_by_engine import MOST_WRONG, STANDS, engine_turns, turns
from codriver.identify.ratio_verdict import refuse_condemned
from codriver.identify.regression import Regression, regress, rms, solve
from codriver.identify.sound import refuse_unsound
from codriver.signals import Log

if TYPE_CHECKING:
    from codriver.vehicles import Vehicle

LEAST_SECONDS = 5.0
LEAST_TORQUE_SPREAD = 10.0  # N m, standard deviation within a gear
RATIO_SD = 0.1  # greatest standard error, as a share of the ratio
LEAST_FREEDOM = 3
SPEED_RANGE = 100.0  # m^2/s^2, standard deviation of v^2: below it drag cannot be told from k_1
MOST_GEARS = 12
ONE_GEAR = 0.1  # share by which engine speed over speed may differ within a gear
GAIN_SD = 0.02  # greatest standard error of gamma, for it to be used
LEAST_SLOPE = 0.1  # m/s^2, RMS of dv/dt that the other columns do not make up; wheel noise alone makes some 0.05


@dataclass(frozen=True)
class GearRatio:
    """What was found of one gear.

    Attributes:
        gear: 1, 2, ...
        ratio: tau/M, 1/(kg m).
        sd: its standard error, from the block bootstrap.
        sd_hac: the same from Newey and West's formula, as a check.
        seconds: used in this gear.
    """

    gear: int
    ratio: float
    sd: float
    sd_hac: float
    seconds: float


@dataclass(frozen=True)
class RatioFit:
    """What was found.

    Attributes:
        gears: by number.
        refused: why the ratio of a gear could not be told, by gear.
        residual: RMS of the fit, m/s^2.
        seconds: how much of the drives was used.
        share: of all ticks that were left out, by reason.
        engine_turns: omega / v by gear, 1/m, where the logs have the engine's speed: tau over the efficiency.
        block: s, length of a block of the bootstrap; `blocks` how many.
        interval_factor: half the width of a 95 % interval in standard errors.
        gain: gamma, the accelerometer's gain error, and its standard error; None where the road is too level to tell.
        trimmed: share of the moments left out as outliers.
        constant: RMS about the mean of [y1]_F, m/s^2.
        remarks, wrong_gears: what is to say about the sensors, and about the log's gear beside the engine's speed.
        sources: of the logs.
    """

    gears: tuple[GearRatio, ...]
    refused: Mapping[int, str]
    residual: float
    seconds: float
    share: Mapping[str, float] = field(repr=False)
    engine_turns: Mapping[int, float]
    block: float
    blocks: int
    interval_factor: float
    gain: tuple[float, float] | None
    trimmed: float
    constant: float
    remarks: tuple[Finding, ...] = ()
    wrong_gears: tuple[Finding, ...] = ()
    sources: tuple[str, ...] = ()

    @property
    def ratio(self) -> float:
        """tau/M of a car of one gear, 1/(kg m).

        Raises:
            UsageError: several gears were found.
        """
        return self._only().ratio

    @property
    def sd(self) -> float:
        """Standard error of `ratio`."""
        return self._only().sd

    def vehicle(self, old: Vehicle) -> Vehicle:
        """The vehicle with tau = ratio M of all its gears, M its own.

        Raises:
            VehicleError: it has no mass.
            LogError: the ratios are condemned (`codriver.identify.ratio_verdict`), or a
                gear below the highest one found could not be told, and the vehicle has no value for it.
        """
        refuse_condemned(self, old)
        M, sd_mass = old.number("mass"), old.parameters["mass"].sd
        known = old.numbers("transmission") if "transmission" in old else ()
        was = old.parameters["transmission"].sd if known else None
        found = {g.gear: g for g in self.gears}
        values, sds, kept = [], [], []
        for gear in range(1, max(len(known), *found) + 1):
            if gear in found:
                values.append(found[gear].ratio * M)
                by_mass = found[gear].ratio * (sd_mass if isinstance(sd_mass, float) else 0.0)
                sds.append(float(np.hypot(found[gear].sd * M, by_mass)))
            elif gear <= len(known):
                values.append(known[gear - 1])
                sds.append(was[gear - 1] if isinstance(was, tuple) else was or 0.0)
                kept.append(gear)
            else:
                raise LogError(
                    f"gear {gear}: {self.refused.get(gear, 'not driven')}, and the vehicle file has no value for it",
                    "all gears up to the highest one driven",
                    "record a drive in that gear too, or put its tau into the vehicle file",
                )
        text = (
            f"tau = M times the ratio identified from {', '.join(self.sources)} with the brake released; 2017 eq. (19), "
            f"{self.seconds / 60:.1f} usable minutes, RMS {self.residual:.3f} m/s^2; the sd holds that of M"
            + (f"; kept from before: gear {', '.join(map(str, kept))}" if kept else "")
        )
        one = len(values) == 1
        return old.with_parameter("transmission", values[0] if one else values, sds[0] if one else sds, text)

    def _only(self) -> GearRatio:
        if len(self.gears) != 1:
            raise UsageError(
                f"ratios of {len(self.gears)} gears", "one gear", "look at RatioFit.gears, which has one entry a gear"
            )
        return self.gears[0]


def identify_ratio(logs: Log | Sequence[Log], *, dt: float = 0.01, seed: int = 0) -> RatioFit:
    """tau/M by gear, by least squares on drives with the brake released.

    Args:
        logs: with longitudinal_speed, longitudinal_acceleration, engine_torque; brake_switch or brake_pressure, gear, clutch and
            engine_speed if there. Without gear, the car is taken for one of one gear.
        dt: tick, s.
        seed: of the bootstrap.

    Raises:
        MissingSignal: a signal is missing.
        LogError: the drives do not excite the ratio of any gear: too short, or the torque hardly changes.
    """
    logs = [logs] if isinstance(logs, Log) else list(logs)
    odd = refuse_unsound(logs, SIGNALS[:-1])
    highest = max((float(np.nanmax(log["gear"].values, initial=1)) for log in logs if "gear" in log), default=1.0)
    count = int(min(max(highest, 1), MOST_GEARS))
    rows = drive_rows(logs, count, dt, known_gears=True, pressure=False, without_braking=True)
    refused, driven = {}, []
    for gear in range(1, count + 1):
        there = rows.keep & (rows.gear == gear)
        seconds = float(there.sum() * dt)
        spread = float(rows.torque[there, gear - 1].std()) if there.any() else 0.0
        if seconds < LEAST_SECONDS or spread < LEAST_TORQUE_SPREAD:
            refused[gear] = (
                f"{seconds:.1f} s of moving with the brake released, in which the torque varies by {spread:.1f} N m"
            )
        else:
            driven.append(gear)
    names = ", ".join(log.source or "a log in memory" for log in logs)
    if not driven:
        raise LogError(
            f"{names}: " + "; ".join(f"gear {gear}: {why}" if count > 1 else why for gear, why in refused.items()),
            f"at least {LEAST_SECONDS:g} s and {LEAST_TORQUE_SPREAD:g} N m (standard deviation)",
            "record a drive with stronger and weaker accelerations",
        )
    fit, gain = _fit(rows, driven, seed, names)
    found = []
    for k, gear in enumerate(driven):
        ratio, sd, hac = float(fit.solution[k]), float(fit.sd[k]), float(fit.sd_hac[k])
        if ratio < -2 * sd:
            refused[gear] = (
                f"{ratio:.3g} 1/(kg m) is negative: the sign of engine_torque is wrong (or of the accelerometer and the speed)"
            )
        elif sd <= RATIO_SD * ratio:
            found.append(GearRatio(gear, ratio, sd, hac, float((fit.used & (rows.gear == gear)).sum() * dt)))
        else:
            refused[gear] = f"{ratio:.3g} 1/(kg m) with a standard error of {sd:.2g}: the torque varies too little"
    if not found:
        raise LogError(
            f"{names}: " + "; ".join(f"gear {gear}: {why}" for gear, why in refused.items()),
            f"positive ratios with a standard error of at most {RATIO_SD:.0%}",
            "mend a sign in the names file (sign = -1), or record a longer drive with stronger and weaker accelerations",
        )
    return RatioFit(
        tuple(found), refused, fit.residual, float(fit.used.sum() * dt), rows.share, engine_turns(logs, rows, count),
        fit.length * dt, fit.blocks, fit.interval_factor, gain, fit.trimmed,
        float(rows.y[fit.used].std()), (*odd, *rows.clipped), tuple(_wrong(logs, rows, found)),
        tuple(short_name(log) for log in logs),
    )  # fmt: skip


def _wrong(logs: Sequence[Log], rows: DriveRows, found: Sequence[GearRatio]) -> list[Finding]:
    """Whether the log's gear is stuck or late: engine speed over speed differs within a gear, whatever tau is."""
    spread = []
    here = turns(logs, rows)
    for g in found:
        there = rows.keep & (rows.gear == g.gear) & (here > STANDS)
        if there.sum() * rows.dt >= LEAST_SECONDS:
            off = float((np.abs(here[there] / np.median(here[there]) - 1) > ONE_GEAR).mean())
            spread += [f"gear {g.gear} {off:.0%}"] if off > MOST_WRONG else []
    if not spread:
        return []
    said = (
        f"engine speed over speed is not one number within a gear of the log (moments that differ: {', '.join(spread)})"
    )
    return [Finding("bad", f"{said}: is the gear stuck or late?")]


def _fit(rows: DriveRows, driven: list[int], seed: int, names: str) -> tuple[Regression, tuple[float, float] | None]:
    """The regression on the gears driven, and gamma with its standard error if it is among the columns.

    Raises:
        LogError: too few stretches that do not resemble one another.
    """
    offered = rows.keep & np.isin(rows.gear, driven)
    log = rows.log_of
    columns = [rows.torque[:, gear - 1] for gear in driven]
    columns += [-(log == k).astype(float) for k in range(rows.pieces.size - 1) if offered[log == k].any()]
    if float(rows.square[offered].std()) > SPEED_RANGE:
        columns.append(-rows.square)
    X = np.column_stack(columns)
    apart = rows.rate[offered] - X[offered] @ solve(X[offered], rows.rate[offered])
    if rms(apart) > LEAST_SLOPE:
        fit = regress(np.column_stack([X, rows.rate]), rows.y, offered, rows.pieces, seed=seed)
        if fit.sd[-1] <= GAIN_SD and fit.freedom >= LEAST_FREEDOM:
            return fit, (float(fit.solution[-1]), float(fit.sd[-1]))
    fit = regress(X, rows.y, offered, rows.pieces, seed=seed)
    if fit.freedom < LEAST_FREEDOM:
        raise LogError(
            f"{names}: {offered.sum() * rows.dt:.0f} usable seconds, whose residuals are alike over stretches of "
            f"{fit.length * rows.dt:.1f} s, so that {fit.blocks} count",
            f"at least {len(columns) + LEAST_FREEDOM} such stretches",
            "record a longer drive, or give several logs",
        )
    return fit, None
