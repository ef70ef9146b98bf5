"""Write an estimate to a file: estimates with standard deviations, flags, innovations, and the inputs that were used."""

from __future__ import annotations

import json
from pathlib import Path

from codriver.estimate import Estimate
from codriver.logs.write import Column, write_table
from codriver.names import VOCABULARY

INPUT_PREFIX = "input."


def save_estimate(estimate: Estimate, path: str | Path, extra: dict[str, str] | None = None) -> None:
    """Write an estimate as Parquet, CSV or MF4, by the suffix.

    Columns: time; each output by its name (units SI); each input signal, held onto the same ticks, as "input.<name>".

    Args:
        estimate: what to write.
        path: ends in .parquet, .csv or .mf4.
        extra: more metadata, such as the command.

    Raises:
        UsageError: the suffix is unknown or the folder cannot be written.
    """
    columns = [
        Column(o.name, estimate.flag(o.name) if o.role == "flag" else estimate.columns[o.name], o.unit, o.meaning)
        for o in estimate.outputs
        if o.name in estimate.columns
    ]
    for name, values in estimate.grid.values.items():
        if name in estimate.log:
            entry = VOCABULARY[name]
            source = estimate.log[name].source
            columns.append(Column(f"{INPUT_PREFIX}{name}", values, entry.unit, f"{entry.meaning}; from {source}"))
    check = estimate.check()
    metadata = {
        **estimate.provenance,
        "log": estimate.log.source,
        "signals": ", ".join(n for n in estimate.grid.values if n in estimate.log),
        "verdict": check.verdict,
        "findings": json.dumps([f"{f.severity}: {f.text}" for f in check.findings], ensure_ascii=False),
        **(extra or {}),
    }
    write_table(path, estimate.time, columns, metadata)
