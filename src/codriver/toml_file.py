"""Files that people write, in TOML: opened and parsed, with errors in words."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from codriver.errors import CodriverError


def read_text(path: str | Path, what: str, kind: type[CodriverError]) -> str:
    """The text of a file.

    Args:
        path: the file.
        what: what it ought to be, for messages ("names file").
        kind: the error to raise.

    Raises:
        kind: it cannot be read, or is no text.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise kind(f"cannot read {path}: {error.strerror}", "a TOML file", "check the path") from None
    except UnicodeDecodeError:
        raise kind(f"{path} is no text", "a TOML file in UTF-8", f"check that it is the {what}") from None


def parse_tables(text: str, where: str, kind: type[CodriverError]) -> dict[str, Any]:
    """What stands at the top of a TOML text, by name.

    Args:
        text: the TOML.
        where: the file it is from, for messages.
        kind: the error to raise.

    Raises:
        kind: it is not TOML.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise kind(f"{where} is not TOML: {error}", "a TOML file", "mend the line named") from None


def quoted(text: str) -> str:
    """A string as TOML writes it: as JSON does, but DEL too must be escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
