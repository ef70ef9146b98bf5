"""What `codriver style` says: the drivers as a table on the terminal, or as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from codriver.drivers import Comparison

HEAD = (
    "driver", "class", "score", "rank", "min", "km", "rms jerk", "j 5 %", "j 95 %", "bursts/km", "reversals/min",
)  # fmt: skip


def told_of(found: Comparison, skipped: Sequence[str], written: Sequence[Path]) -> dict[str, Any]:
    """What --json prints.

    Args:
        found: the comparison.
        skipped: why logs were left out.
        written: files.
    """
    from codriver.drivers.style_file import rows_of

    findings = [{"severity": f.severity, "text": f.text} for f in found.told]
    return {
        "estimator": found.styles[0].observer,
        "ell": found.styles[0].ell,
        "aligned": found.aligned,
        "scale": found.scale.name if found.scale else None,
        "drivers": rows_of(found),
        "findings": findings + [{"severity": "warn", "text": text} for text in skipped],
        "written": [str(path) for path in written],
    }


def say_styles(told: dict[str, Any]) -> None:
    """The table and the findings."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings
    from codriver.drivers.scale import sure

    out = console()
    out.print(f"[bold]{told['estimator']}[/], ell {told['ell']}; aligned by {told['aligned'] or 'nothing'}; scale: "
              f"{escape(told['scale'] or 'none fits')}\n")  # fmt: skip
    table = Table(box=None, pad_edge=False)
    for column in HEAD:
        table.add_column(column, justify="left" if column in ("driver", "class") else "right")
    for row in told["drivers"]:
        kind, probability = row["class"], row.get(f"p_{row['class']}")
        table.add_row(
            escape(row["driver"]), kind + (f" {sure(probability)}" if probability is not None else ""),
            _cell(row, "score"), "-" if row["rank"] is None else f"{row['rank']} ({row['rank_low']}-{row['rank_high']})",
            f"{row['valid_s'] / 60:.1f}", f"{row['valid_km']:.1f}", _cell(row, "jerk_rms_m/s3"),
            _cell(row, "jerk_q05_m/s3"), _cell(row, "jerk_q95_m/s3"), _cell(row, "bursts_per_km"),
            _cell(row, "pedal_reversals_per_min", 1),
        )  # fmt: skip
    out.print(table)
    reasons = [{"severity": "warn", "text": f"{row['driver']}: {row['why']}"} for row in told["drivers"] if row["why"]]
    say_findings(out, [*told["findings"], *reasons])
    if told["written"]:
        out.print(f"\nwrote {escape(', '.join(told['written']))}")


def _cell(row: dict[str, Any], key: str, digits: int = 2) -> str:
    """A value and its interval."""
    value, low, high = row.get(key), row.get(f"{key}_low"), row.get(f"{key}_high")
    if value is None:
        return "-"
    return f"{value:.{digits}f}" + (f" ({low:.{digits}f}-{high:.{digits}f})" if low is not None else "")
