"""The command line: one file a command, heavy imports inside the functions."""

from codriver.cli.app import main

__all__ = ["main"]
