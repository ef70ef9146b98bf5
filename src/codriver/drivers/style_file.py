"""The table of drivers: one row a driver, as Parquet or CSV, or as JSON holds it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from codriver.drivers.bands import BANDS
from codriver.drivers.compare import Comparison
from codriver.drivers.resampling import Interval
from codriver.drivers.scale import CLASSES, Rating
from codriver.drivers.style import DriverStyle
from codriver.errors import UsageError
from codriver.logs.write import check_output, complete_or_nothing

SUFFIXES = (".parquet", ".pq", ".csv")


def check_styles_name(path: str | Path) -> Path:
    """Whether a table of styles can be written here.

    Raises:
        UsageError: the suffix is none of SUFFIXES, or the folder cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(
            f"cannot write styles to '{path.name}'", f"a name ending in {', '.join(SUFFIXES)}", "choose one of these"
        )
    return check_output(path)


def rows_of(comparison: Comparison) -> list[dict[str, Any]]:
    """One row of plain values a driver, all with the same keys; units stand in the keys."""
    ranks = {rank.name: rank for rank in comparison.ranking}
    rows = []
    for style, rating in zip(comparison.styles, comparison.ratings, strict=True):
        rank = ranks.get(style.name)
        rows.append({
            "driver": style.name,
            "logs": "; ".join(style.sources),
            **_rated(rating),
            "findings": "; ".join(f"{f.severity}: {f.text}" for f in comparison.doubts[style.name]),
            "rank": rank.rank if rank else None,
            "rank_low": rank.low if rank else None,
            "rank_high": rank.high if rank else None,
            **_numbers(style),
            "estimator": style.observer,
            "ell": style.ell,
        })  # fmt: skip
    return rows


def save_styles(comparison: Comparison, path: str | Path) -> Path:
    """Write the table, whole or not at all.

    Raises:
        UsageError: see `check_styles_name`.
        LogError: it cannot be written.
    """
    import pyarrow as pa

    path = check_styles_name(path)
    table = pa.Table.from_pylist(_filled(rows_of(comparison)))
    with complete_or_nothing(path) as draft:
        if path.suffix.lower() == ".csv":
            from pyarrow import csv

            csv.write_csv(table, draft)
        else:
            from pyarrow import parquet

            parquet.write_table(table, draft, compression="zstd")
    return path


def _rated(rating: Rating | None) -> dict[str, Any]:
    probability = rating.probability if rating else {}
    return {
        "score": rating.score if rating else None,
        "score_sd": rating.sd if rating else None,
        "score_low": rating.low if rating else None,
        "score_high": rating.high if rating else None,
        "class": rating.kind if rating else "cannot tell",
        **{f"p_{kind}": probability.get(kind) for kind in CLASSES},
        "why": "; ".join(rating.why) if rating else "no scale fits",
    }


def _numbers(style: DriverStyle) -> dict[str, Any]:
    row: dict[str, Any] = {
        "duration_s": style.duration, "valid_s": style.seconds, "valid_km": style.kilometres,
        **_interval("jerk_rms_m/s3", style.jerk_rms),
    }  # fmt: skip
    for name, quantiles in (("jerk", style.jerk), ("acceleration", style.acceleration)):
        unit = "m/s3" if name == "jerk" else "m/s2"
        for p, found in quantiles.items():
            row |= _interval(f"{name}_q{100 * p:02.0f}_{unit}", found)
    row |= {
        "bursts": style.bursts.count, "bursts_per_km": style.bursts.per_km, "bursts_per_km_low": style.bursts.low,
        "bursts_per_km_high": style.bursts.high, "bursts_dispersion": style.bursts.dispersion,
        "burst_threshold_m/s3": style.threshold.on, "bursts_in_shift_share": style.in_shift,
        **_interval("burst_peak_m/s3", style.burst_peak),
        **_interval("pedal_reversals_per_min", style.reversals),
    }  # fmt: skip
    driven = {entry.band.name: entry for entry in style.bands}
    for name in (band.name for band in BANDS):
        entry = driven.get(name)
        row |= {
            f"{name}_s": entry.seconds if entry else 0.0, f"{name}_km": entry.kilometres if entry else 0.0,
            f"{name}_jerk_rms_m/s3": entry.jerk_rms.value if entry else None,
            f"{name}_bursts_per_km": entry.bursts.per_km if entry else None,
        }  # fmt: skip
    return row


def _interval(name: str, found: Interval | None) -> dict[str, float | None]:
    return {
        name: found.value if found else None,
        f"{name}_low": found.low if found else None,
        f"{name}_high": found.high if found else None,
    }


def _filled(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows that all have the keys of all, in the order they first appear."""
    keys = list(dict.fromkeys(key for row in rows for key in row))
    return [{key: row.get(key) for key in keys} for row in rows]
