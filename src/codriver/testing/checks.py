"""What an observer, a reader and a vehicle must keep to."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from codriver.errors import CodriverError
from codriver.export.golden import golden_inputs
from codriver.kernel.record import interpret
from codriver.logs.recording import Recording, SourceChannel
from codriver.logs.registry import ReaderFunction, ReadOptions
from codriver.names import VOCABULARY
from codriver.observers.observer import Observer
from codriver.program import compile
from codriver.vehicles import Vehicle
from codriver.vehicles.load import KNOWN

_ROLES = {"estimate", "sd", "innovation", "innovation_sd", "flag", "input"}


def check_observer(observer: Observer, rows: int = 200) -> None:
    """Check an observer of one's own.

    Names are the vocabulary's; the step returns its whole carry and all outputs; batch, live and CasADi's interpreter
    agree bit for bit; values whose flag is 0 are never looked at; flags are 0 or 1; standard deviations are not negative;
    a saved state continues with the same bits.

    Args:
        observer: to check.
        rows: ticks of the made-up drive.

    Raises:
        AssertionError: what is broken.
    """
    assert observer.dt > 0, "dt must be positive"
    unknown = [n for n in observer.channels if n not in VOCABULARY]
    assert not unknown, f"{unknown} are no standard names (codriver.names.VOCABULARY)"
    assert observer.optional <= set(observer.channels), "optional signals must be among the channels"
    assert len(set(observer.channels)) == len(observer.channels), "a channel is named twice"
    names = [o.name for o in observer.outputs]
    assert len(set(names)) == len(names), "an output is named twice"
    assert all(o.role in _ROLES for o in observer.outputs), f"roles must be among {sorted(_ROLES)}"
    assert all(math.isfinite(v) for v in observer.carry.values()), "the initial carry must be finite"

    program = compile(observer)
    grid = golden_inputs(program, rows)
    batch = program.run_grid(grid)
    flags = observer.flag_columns(grid)
    stepper, carry = program.live(), dict(observer.carry)
    resumed = program.live()
    for k in range(rows):
        ok = [bool(column[k]) for column in flags]
        values = [float(grid.values[n][k]) for n in observer.channels]
        seen = {flag.channel for flag, there in zip(observer.flags, ok, strict=True) if there}
        hidden = [v if n in seen else math.nan for n, v in zip(observer.channels, values, strict=True)]
        live = stepper([*hidden, *ok])
        inputs = dict(zip(program.recorded.inputs, [*values, *map(float, ok)], strict=True))
        new, out = interpret(program.recorded, carry, inputs)
        carry = dict(zip(program.recorded.carry, new, strict=True))
        for name, by_live, by_casadi in zip(program.recorded.outputs, live, out, strict=True):
            by_batch = float(batch[name][k])
            assert not math.isnan(by_live), f"{name} is NaN at tick {k}; does the step look at a value whose ok is 0?"
            assert by_live.hex() == by_batch.hex(), f"{name}: live {by_live!r} is not batch {by_batch!r} at tick {k}"
            assert by_live.hex() == by_casadi.hex(), f"{name}: {by_live!r} is not CasADi's {by_casadi!r} at tick {k}"
        if k == rows // 2:
            resumed.restore(stepper.save())
        elif k > rows // 2:
            assert resumed([*hidden, *ok]) == live, f"a saved state does not continue alike at tick {k}"
    for output in observer.outputs:
        column = batch[output.name]
        if output.role == "flag":
            assert np.isin(column, (0.0, 1.0)).all(), f"{output.name} is a flag but is not always 0 or 1"
        if output.role in ("sd", "innovation_sd"):
            assert (column >= 0).all(), f"{output.name} is a standard deviation but is negative"


def check_reader(function: ReaderFunction, good: Path, broken: Iterable[Path], dbc: Path | None = None) -> None:
    """Check a reader of one's own.

    Opening and loading give what Recording promises; names that are no channels are left out; broken files raise an error
    of codriver's, with its three sentences.

    Args:
        function: the reader.
        good: a recording it must read.
        broken: files it must refuse, or read with a fault noted.
        dbc: CAN database, if the format needs one.

    Raises:
        AssertionError: what is broken.
    """
    recording = function(good, ReadOptions(dbc=dbc))
    assert isinstance(recording, Recording), "a reader returns a Recording"
    assert recording.format, "format must say what the file is"
    channels = recording.channels()
    assert channels, "no channels"
    assert all(isinstance(c, SourceChannel) and c.name == key for key, c in channels.items()), (
        "channels are by their own names"
    )
    loaded = recording.load([*channels, "no such channel"])
    assert "no such channel" not in loaded, "a name that is no channel is left out"
    for name, raw in loaded.items():
        assert name in channels, f"{name} was loaded but is not listed"
        assert raw.time.shape == raw.values.shape, f"{name}: time and values differ in shape"
        assert raw.values.dtype == np.float64, f"{name}: values are {raw.values.dtype}, not float64"
    for path in broken:
        try:
            damaged = function(path, ReadOptions(dbc=dbc))
            damaged.load(damaged.channels())
        except CodriverError as error:
            assert all((error.found, error.expected, error.do)), f"{path.name}: the error lacks a sentence"
        else:
            assert damaged.faults, f"{path.name}: read without an error and without a fault"


def check_vehicle(vehicle: Vehicle) -> None:
    """Check a vehicle built in Python (files are checked when they are loaded).

    Raises:
        AssertionError: what is broken.
    """
    assert all((vehicle.name, vehicle.title, vehicle.source)), "name, title and source must be given"
    for name, parameter in vehicle.parameters.items():
        assert name in KNOWN, f"'{name}' is no parameter; they are {', '.join(KNOWN)}"
        known = KNOWN[name]
        values = parameter.value if isinstance(parameter.value, tuple) else (parameter.value,)
        assert parameter.unit == known.unit, f"{name} is in {parameter.unit}, not in {known.unit}"
        assert known.per_gear or len(values) == 1, f"{name} must be one number"
        assert all(known.low <= v <= known.high for v in values), (
            f"{name} = {values} is outside {known.low} to {known.high}"
        )
        assert parameter.source, f"{name} has no source"
