"""The one exception tree.

    CodriverError
    ├── LogError            a recording cannot be read, or holds too little to go on
    │   ├── FormatError     not a file of the format its name or content promises
    │   └── MissingSignal   the log lacks a signal the estimator needs
    ├── NamesError          a names file is wrong
    ├── VehicleError        a vehicle file is wrong, or lacks a parameter the estimator needs
    ├── UnitError           a unit is unknown, or not one of the quantity it is given to
    ├── DesignError         an observer cannot be designed: the certificate failed
    ├── KernelError         a step uses an operation the kernel does not carry
    └── UsageError          the caller asked for something that does not exist

Every message says three things: what was found, what was expected, and what to do. They are the three arguments of the
constructor, so none can be forgotten.
"""

from __future__ import annotations


class CodriverError(Exception):
    """Base of all errors codriver raises on purpose.

    Args:
        found: what was met, with the names and numbers that identify it.
        expected: what would have been right.
        do: what the reader of the message can do about it.
    """

    exit_code = 1  # the data does not allow it

    def __init__(self, found: str, expected: str, do: str) -> None:
        super().__init__(found, expected, do)
        self.found, self.expected, self.do = found, expected, do

    def __str__(self) -> str:
        return f"{self.found}\n  expected: {self.expected}\n  to do: {self.do}"


class LogError(CodriverError):
    """A recording cannot be read, or holds too little to go on."""


class FormatError(LogError):
    """A file is not of the format that its name or content promises."""


class MissingSignal(LogError):
    """The log lacks a signal that the estimator needs."""


class NamesError(CodriverError):
    """A names file is wrong."""

    exit_code = 2


class VehicleError(CodriverError):
    """A vehicle file is wrong, or lacks a parameter that the estimator needs."""

    exit_code = 2


class UnitError(CodriverError):
    """A unit is unknown, or does not measure the quantity it is given to."""

    exit_code = 2


class DesignError(CodriverError):
    """An observer cannot be designed as asked."""


class KernelError(CodriverError):
    """A step uses an operation that the kernel does not carry."""


class UsageError(CodriverError):
    """The caller asked for something that does not exist or does not fit."""

    exit_code = 2
