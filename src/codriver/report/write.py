"""Write a report to a file, whole or not at all."""

from __future__ import annotations

from pathlib import Path

from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.report.page import page
from codriver.signals import Log
from codriver.trust import Check
from codriver.whole_file import write_text


def write_report(
    estimate: Estimate,
    path: str | Path,
    *,
    title: str | None = None,
    truth: Log | None = None,
    command: str | None = None,
    check: Check | None = None,
) -> None:
    """Write an estimate as one self-contained HTML file: plots, verdict, figures, provenance.

    The file is written beside its final name and renamed, so a reader never meets half of it.

    Args:
        estimate: what to report.
        path: of the file; its folder must exist.
        title: by default the estimator's subject and the recording's file name.
        truth: a reference to draw and to state errors against: signals by standard names, and planned_acceleration,
            planned_jerk where the driver's plan is known.
        command: the command that made it, for the provenance.
        check: what is found of it; by default `estimate.check()`, to which a caller may have added.

    Raises:
        UsageError: the file cannot be written.
    """
    write_whole(page(estimate, title, truth, command, check), Path(path))


def write_whole(content: str, target: Path) -> None:
    """Write text to a file that appears under its name only when it is complete.

    Raises:
        UsageError: the file cannot be written.
    """
    try:
        write_text(target, content)
    except OSError as error:
        raise UsageError(
            f"the report {target} cannot be written: {error.strerror or error}",
            "a file in a folder that exists and may be written",
            "make the folder, or choose another path",
        ) from error  # fmt: skip
