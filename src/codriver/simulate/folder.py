"""A folder of files, written whole or not at all, and never over files of somebody else.

Everything goes to a temporary folder beside it first, and is moved into place when it is complete.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from codriver.errors import LogError, UsageError

_OWN = ("car.dbc", "drive.blf", "truth.parquet")  # a folder with these was written here


def refuse_foreign(folder: Path, what: str, own: Sequence[str] = _OWN) -> None:
    """A simulation replaces files only where an earlier one wrote them.

    Args:
        folder: to write into.
        what: is written, for people ("demo").
        own: a folder with these files was written by an earlier one.

    Raises:
        UsageError: the folder is a file, or holds files and no simulation.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"--out {folder} is a file", "a folder, or a name that is free", "choose another --out")
    if folder.is_dir() and any(folder.iterdir()) and not all((folder / name).is_file() for name in own):
        raise UsageError(
            f"--out {folder} holds files that are no {what}",
            f"a folder that is new, empty or an earlier {what}'s",
            "choose another --out",
        )


def refuse_earlier(out: Path, overwrite: bool) -> None:
    """Refuse a folder that holds files, where they are not to be replaced.

    Raises:
        UsageError: see there.
    """
    if not overwrite and out.is_dir() and any(out.iterdir()):
        raise UsageError(
            f"--out {out} holds an earlier simulation",
            "a new or empty folder",
            "choose another --out, or say --overwrite",
        )


def write_folder(folder: Path, write: Callable[[Path], None], what: str, own: Sequence[str] = _OWN) -> None:
    """Let `write` fill a temporary folder, then move its files into `folder`, made if need be.

    Args:
        folder: to write into.
        write: writes all files into the folder it is given.
        what: is written, for people ("demo").
        own: as for `refuse_foreign`.

    Raises:
        UsageError: the folder is a file, or holds files and no simulation.
        LogError: a file cannot be written; the folder is as it was.
    """
    refuse_foreign(folder, what, own)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".codriver-") as scratch:
            write(Path(scratch))
            folder.mkdir(exist_ok=True)
            for draft in sorted(Path(scratch).iterdir()):
                shutil.move(str(draft), folder / draft.name)
    except (OSError, LogError) as error:
        # A LogError names the temporary folder; its cause is the system's.
        cause = error if isinstance(error, OSError) else error.__cause__
        said = cause.strerror if isinstance(cause, OSError) and cause.strerror else str(cause or error)
        raise LogError(
            f"cannot write the {what} into {folder}: {said}",
            "room on the disk and the right to write",
            "remove the cause, or choose another --out",
        ) from error
