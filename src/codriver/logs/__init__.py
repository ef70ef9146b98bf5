"""Readers and writers, one file a format."""

from codriver.logs.read import open_recording, read
from codriver.logs.recording import Channel, Recording
from codriver.logs.registry import formats, reader

__all__ = ["Channel", "Recording", "formats", "open_recording", "read", "reader"]
