"""A compiled observer: over a whole log, or sample by sample.

    program = compile(observer)
    estimate = program.run(log)        # batch
    stepper = program.live()           # one call a sample

Both run the same machine code, so their results have the same bits.
"""

from __future__ import annotations

import ctypes
import json
import struct
from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np

from codriver.errors import LogError, MissingSignal, UsageError
from codriver.estimate import Estimate
from codriver.kernel.llvm import Compiled, compile_loop
from codriver.kernel.record import Recorded
from codriver.names import VOCABULARY
from codriver.observers.observer import Observer
from codriver.signals import Grid, Log
from codriver.signals.signal import Array

ANOTHER_CLOCK = 3600.0  # s between the ends of signals that cannot be a pause


def compile(observer: Observer, outputs: Sequence[str] | None = None) -> Program:
    """Record and compile an observer.

    Args:
        observer: the design.
        outputs: names of the outputs wanted; None gives all, fewer run faster.

    Raises:
        UsageError: the observer has no such output.
        KernelError: its step uses operations the kernel does not carry.
    """
    known = [output.name for output in observer.outputs]
    unknown = [name for name in outputs or () if name not in known]
    if unknown:
        raise UsageError(
            f"'{observer.name}' has no output {unknown}", f"some of {', '.join(known)}", "correct the name"
        )
    recorded = observer.record(None if outputs is None else tuple(outputs))
    return Program(observer, recorded, compile_loop(recorded))


class Program:
    """An observer compiled for this machine.

    Attributes:
        observer: the design.
        recorded: its step as straight-line code.
    """

    def __init__(self, observer: Observer, recorded: Recorded, compiled: Compiled) -> None:
        self.observer, self.recorded, self._compiled = observer, recorded, compiled

    def run(self, log: Log, *, start: float | None = None, stop: float | None = None) -> Estimate:
        """Run over a log.

        The log is sampled by causal hold at the observer's dt, from its first measurement to its last.

        Args:
            log: has at least the observer's required signals.
            start, stop: bounds, s; by default all of the log.

        Raises:
            MissingSignal: the log lacks a required signal.
            LogError: required signals lie more than an hour apart: their clocks are not the same.
        """
        refuse_missing(self.observer, log)
        if start is None:
            main = self.observer.measured or self.observer.required
            start = min((float(log[name].time[0]) for name in main if name in log), default=log.start)
        _refuse_mixed_clocks(log, self.observer.required)
        grid = log.sample(self.observer.channels, self.observer.dt, start=start, stop=stop)
        values = self.run_grid(grid)
        return Estimate(
            self.observer.name,
            grid,
            values,
            self.observer.outputs,
            self.observer.measured,
            provenance(self.observer),
            log,
        )

    def run_grid(self, grid: Grid) -> dict[str, Array]:
        """Run over sampled columns, from the observer's initial carry: a column for each output."""
        return self.advance(grid, self.observer.carry)[1]

    def advance(self, grid: Grid, carry: Mapping[str, float]) -> tuple[dict[str, float], dict[str, Array]]:
        """Run on over sampled columns.

        Args:
            grid: has the observer's channels.
            carry: where to start from.

        Returns:
            the carry after the last tick, and a column for each output: a drive in pieces gives the bits of the whole.
        """
        n = len(grid)
        columns = [np.ascontiguousarray(grid.values[name], dtype=np.float64) for name in self.observer.channels]
        flags = [np.ascontiguousarray(flag, dtype=np.bool_) for flag in self.observer.flag_columns(grid)]
        outputs = [np.empty(n) for _ in self.recorded.outputs]
        state = np.array([carry[key] for key in self.recorded.carry], dtype=np.float64)
        given = _pointers([*columns, *flags])
        made = _pointers(outputs)
        self._compiled.run(n, state.ctypes.data, ctypes.addressof(given), ctypes.addressof(made))
        after = dict(zip(self.recorded.carry, state.tolist(), strict=True))
        return after, dict(zip(self.recorded.outputs, outputs, strict=True))

    def live(self) -> Stepper:
        """A stepper at the observer's initial carry."""
        return Stepper(self)


class Stepper:
    """One step a call.

    `stepper(row)` is the quick way: `row` holds the numbers of `inputs` in order (channels, then 1 or 0 for each flag
    of the observer), the result those of `outputs`. `step(values)` is the easy one. The state can be saved and restored exactly.

    Attributes:
        inputs, outputs: names, in the order of the row and the result.
    """

    def __init__(self, program: Program) -> None:
        recorded, observer = program.recorded, program.observer
        self.inputs, self.outputs = recorded.inputs, recorded.outputs
        self._program = program  # owns the machine code
        self._run = program._compiled.run
        channels, flags = len(observer.channels), len(observer.flags)
        self._channels, self._flags = observer.channels, observer.flags
        self._carry = (ctypes.c_double * max(len(recorded.carry), 1))(*[observer.carry[key] for key in recorded.carry])
        self._in = ctypes.create_string_buffer(8 * channels + flags or 1)
        self._out = (ctypes.c_double * max(len(recorded.outputs), 1))()
        base = ctypes.addressof(self._in)
        where = [base + 8 * k for k in range(channels)] + [base + 8 * channels + k for k in range(flags)]
        self._given = (ctypes.c_void_p * max(len(where), 1))(*where)
        out = ctypes.addressof(self._out)
        self._made = (ctypes.c_void_p * max(len(recorded.outputs), 1))(
            *[out + 8 * k for k in range(len(recorded.outputs))]
        )
        self._pack = struct.Struct(f"={channels}d{flags}?").pack_into
        self._unpack = struct.Struct(f"={len(recorded.outputs)}d").unpack_from
        self._call = (1, ctypes.addressof(self._carry), ctypes.addressof(self._given), ctypes.addressof(self._made))

    def __call__(self, row: Sequence[float]) -> tuple[float, ...]:
        """One step: numbers of `inputs` in, numbers of `outputs` out. Values whose flag is 0 may be NaN."""
        self._pack(self._in, 0, *row)
        self._run(*self._call)
        return self._unpack(self._out)

    def step(self, values: Mapping[str, float]) -> dict[str, float]:
        """One step from what is there now: a channel that is absent or not finite is not ok.

        Args:
            values: by standard name: inputs as last known, measurements only on the tick they arrived. Names that the
                observer does not use are left out.

        Raises:
            UsageError: a name is no standard name.
        """
        strange = [name for name in values if name not in self._channels and name not in VOCABULARY]
        if strange:
            raise UsageError(
                f"{strange} are no standard signal names", f"some of {', '.join(self._channels)}", "see docs/names.md"
            )
        numbers = {name: float(values.get(name, float("nan"))) for name in self._channels}
        there = [isfinite(numbers[flag.channel]) for flag in self._flags]
        return dict(zip(self.outputs, self([*numbers.values(), *there]), strict=True))

    @property
    def carry(self) -> dict[str, float]:
        """The carried scalars, by name."""
        return dict(zip(self._program.recorded.carry, self._carry, strict=False))

    def save(self) -> str:
        """The state as JSON text with hexadecimal floats: restored, it continues with the same bits."""
        exact = {name: value.hex() for name, value in self.carry.items()}
        return json.dumps({"design": self._design(), "carry": exact})

    def _design(self) -> dict[str, str]:
        """What a saved state must agree with: the settings, and the step itself (a vehicle's numbers are in it)."""
        return {**provenance(self._program.observer), "step": self._program.recorded.fingerprint()}

    def restore(self, text: str) -> None:
        """Continue from a saved state.

        Raises:
            UsageError: the text was saved by another design (name, settings) or version.
        """
        try:
            saved = json.loads(text)
            design = dict(saved["design"])
            carry = {name: float.fromhex(value) for name, value in saved["carry"].items()}
        except (ValueError, KeyError, TypeError, AttributeError):
            raise UsageError("text that is no saved state", "what Stepper.save gave", "save again") from None
        mine = self._design()
        if design != mine or list(carry) != list(self._program.recorded.carry):
            differ = [key for key in {**mine, **design} if mine.get(key) != design.get(key)]
            said = [", ".join(f"{key} = {d.get(key)}" for key in differ) or "another carry" for d in (design, mine)]
            raise UsageError(
                f"a state saved with {said[0]}", f"one saved with {said[1]}",
                "restore it into a stepper of the same design, outputs and version",
            )  # fmt: skip
        self._carry[: len(carry)] = list(carry.values())


def refuse_missing(observer: Observer, log: Log) -> None:
    """Refuse a log that lacks what an observer requires.

    Raises:
        MissingSignal: the message names what is missing.
    """
    lacking = [name for name in observer.required if name not in log or not len(log[name])]
    if lacking:
        told = [fault for fault in log.faults if any(fault.startswith(name) for name in lacking)]
        raise MissingSignal(
            f"{observer.name} cannot run on {log.source or 'this log'}: it lacks {', '.join(lacking)}"
            + (f" ({'; '.join(told)})" if told else ""),
            f"the signals {', '.join(observer.required)}",
            "map them in a names file, or use an estimator that does without; `codriver info LOG` says which",
        )


def _refuse_mixed_clocks(log: Log, names: Sequence[str]) -> None:
    """Signals whose spans lie far apart have no tick in common.

    Raises:
        LogError: see `Program.run`.
    """
    if not names:
        return
    late = max(names, key=lambda name: float(log[name].time[0]))
    early = min(names, key=lambda name: float(log[name].time[-1]))
    if log[late].time[0] - log[early].time[-1] > ANOTHER_CLOCK:
        raise LogError(
            f"{log.source or 'this log'}: {early} ends at {log[early].time[-1]:.10g} s, "
            f"{late} begins at {log[late].time[0]:.10g} s", "signals on one clock",
            "they bear stamps of two clocks: record them on one, or shift one file's time column",
        )  # fmt: skip


def provenance(observer: Observer) -> dict[str, str]:
    """What made an estimate: version, estimator, settings."""
    from codriver import __version__

    return {"codriver": __version__, "observer": observer.name, **{k: str(v) for k, v in observer.settings.items()}}


def _pointers(arrays: Sequence[np.ndarray]) -> ctypes.Array[ctypes.c_void_p]:
    """Addresses of arrays, which the caller keeps alive."""
    return (ctypes.c_void_p * max(len(arrays), 1))(*[array.ctypes.data for array in arrays])
