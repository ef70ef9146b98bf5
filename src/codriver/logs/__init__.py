"""Readers and writers, one file a format."""

from codriver.logs.read import open_recording, read
from codriver.logs.recording import Recording, SourceChannel
from codriver.logs.registry import formats, reader

__all__ = ["Recording", "SourceChannel", "formats", "open_recording", "read", "reader"]
