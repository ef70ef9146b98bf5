"""A driver's drive cut at the holes of its signals: each piece counts as a drive of its own.

    hole = a stretch of more than LONGEST_HOLE between two numbers of a signal that is needed

What a driver saw and did in a hole is not known, nor the model's state at its end, so each piece settles anew: SETTLED and PREVIEW
seconds of it do not count. A piece is left out, and named, if it is shorter than a drive must be, stands, goes straight, or varies
too much in speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf, nextafter

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.driver_holes import LONGEST_HOLE, Hole, between, covered, holes_of, holes_told
from codriver.identify.driver_record import LEAST_SECONDS, DriverRecord, driver_record, needed
from codriver.signals import Log

_NAMED = 3  # stretches that a sentence lists


@dataclass(frozen=True)
class LeftOut:
    """A piece that is not used.

    Attributes:
        start, stop: s, by the log's clock.
        why: in words.
    """

    start: float
    stop: float
    why: str


@dataclass(frozen=True, eq=False)
class DrivePieces:
    """A drive between its holes.

    Attributes:
        source: of the log.
        records: of the pieces that are used; one of the whole drive where it has no holes.
        spans: start and stop of each of them, s, by the log's clock.
        holes: by signal; left_out: pieces that are not used.
    """

    source: str
    records: tuple[DriverRecord, ...] = field(repr=False)
    spans: tuple[tuple[float, float], ...]
    holes: tuple[Hole, ...] = ()
    left_out: tuple[LeftOut, ...] = ()

    def findings(self) -> tuple[Finding, ...]:
        """A judged sentence if the drive has holes."""
        if not self.holes:
            return ()
        used = f"{len(self.spans)} piece{'s' if len(self.spans) > 1 else ''} used, {_listed(self.spans)}"
        said = f"{self.source}: {holes_told(self.holes)}; {used}, each settling anew"
        left = "; left out " + _left(self.left_out) if self.left_out else ""
        return (Finding("warn", said + left, tuple((h.start, h.stop) for h in self.holes)),)


def drive_pieces(log: Log, near: float, far: float) -> DrivePieces:
    """Take a drive, in pieces if it has holes.

    Args:
        log, near, far: as for `driver_record`.

    Raises:
        MissingSignal: the log lacks a signal.
        LogError: no piece can be used, or nothing happens in a drive without holes.
    """
    name = log.source or "this log"
    stamps = {n: log[n].time[np.isfinite(log[n].values)] for n in needed(log)[0]}
    holes = holes_of(stamps) if all(t.size for t in stamps.values()) else ()
    if not holes:
        record = _record(log, near, far)
        return DrivePieces(name, (record,), (covered(stamps),))
    records, spans, left_out = [], [], []
    for start, stop in between(holes, covered(stamps)):
        if stop - start < LEAST_SECONDS:
            left_out.append(LeftOut(start, stop, f"shorter than {LEAST_SECONDS:g} s"))
            continue
        piece = replace(log.between(start, nextafter(stop, inf)), source=f"{name}, {start:.1f} to {stop:.1f} s")
        try:
            record = _record(piece, near, far)
        except LogError as error:
            left_out.append(LeftOut(start, stop, error.found.removeprefix(f"{piece.source}: ")))
            continue
        records.append(replace(record, start=start - covered(stamps)[0]))
        spans.append((start, stop))
    if not records:
        raise LogError(
            f"{name}: {holes_told(holes)}, and no piece between them can be used: {_left(left_out) or 'none is left'}",
            f"a piece of at least {LEAST_SECONDS:g} s at one speed, with curves and a number every {LONGEST_HOLE:g} s",
            "record such a drive; look why the signals with holes are missing there",
        )
    return DrivePieces(name, tuple(records), tuple(spans), holes, tuple(left_out))


def _record(log: Log, near: float, far: float) -> DriverRecord:
    """A record in which something happens; a drive in which nothing does tells nothing."""
    record = driver_record(log, near, far)
    rows = slice(record.first, record.last)
    bent, torque = float(np.std(record.curvature[rows])), float(np.std(record.torque[rows]))
    if bent < 1e-5 or torque < 1e-3:
        raise LogError(
            f"{record.source}: a curvature that changes by {bent:.2g} 1/m and a torque that changes by {torque:.2g} N m (sd)",
            "a drive with curves, and a torque that was measured or estimated",
            "record such a drive",
        )
    return record


def _left(pieces: Sequence[LeftOut]) -> str:
    """Which are left out and why: those of one reason together."""
    said = []
    for why in dict.fromkeys(p.why for p in pieces):
        said.append(f"{_listed([(p.start, p.stop) for p in pieces if p.why == why])}: {why}")
    return "; ".join(said)


def _listed(spans: Sequence[tuple[float, float]]) -> str:
    more = f" and {len(spans) - _NAMED} more" if len(spans) > _NAMED else ""
    return ", ".join(f"{start:.1f}-{stop:.1f} s" for start, stop in spans[:_NAMED]) + more
