"""A text file that appears under its name only when it is complete."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path


def write_text(target: Path, text: str) -> None:
    """Write text to a draft beside the target, then rename it; a reader never meets half a file.

    Raises:
        OSError: it cannot be written; the target is as it was, and the draft is gone.
    """
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
    draft = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
        draft.chmod(0o644)  # mkstemp's file is for its owner alone
        draft.replace(target)
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
