"""How long a kernel takes to compile: LLVM text through llvmlite, as we do it, against numba on the same instructions.

Both print the recorded list line by line as one loop over samples; the results must have the same bits. numba is no
dependency of ours: without it, only our own times are shown.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from importlib.util import find_spec

import numpy as np
from measure import Row, compared, measure, say

import codriver as cd
from codriver.kernel import Recorded, record
from codriver.kernel.llvm import compile_loop

_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "eq": "==", "ne": "!="}


def run(quick: bool = False) -> Iterator[Row]:
    """All rows; quickly, the smallest kernel alone."""
    vehicle = cd.load_vehicle("bisoffi2017")
    cases = [("pedals-only", "kalman"), ("kinematic", "constant"), ("kinematic", "kalman"), ("intent-pedals", "kalman")]
    for name, form in cases[:1] if quick else cases:
        observer = cd.build(name, vehicle, form=form)
        recorded = observer.record()
        what = f"compile {name}, {form} form" if name != "pedals-only" else f"compile {name}"
        say(f"  {what}")
        ours = measure(lambda recorded=recorded: compile_loop(recorded, anew=True), 2 if quick else 5)
        operations = f"{recorded.operations()} operations"
        if find_spec("numba") is None:
            yield Row(what, f"{ours.best:.3f} s (+{ours.spread})", note=f"{operations}; numba is not installed")
            continue
        columns = _columns(recorded)
        _compile_by_numba(_smallest(), _columns(_smallest()))  # numba's import and first start are left out
        other = _compile_by_numba(recorded, columns, observer)
        result = cd.compile(observer).run_grid(_grid(observer, recorded, columns))
        same = all(result[n].tobytes() == columns[1][k].tobytes() for k, n in enumerate(recorded.outputs))
        if not same:
            raise ValueError("numba gives other bits")
        note = f"{operations}; same bits; numba's import and first start left out"
        yield compared(what, ours.best, "numba", other, note, None, ours.spread)


def numba_source(recorded: Recorded) -> str:
    """The loop over samples as Python text for numba: `loop(inputs, outputs, carry)`, one row a column."""
    lines = ["def loop(inputs, outputs, carry):"]
    lines += [f"    c{k} = carry[{k}]" for k in range(len(recorded.carry))]
    lines.append("    for k in range(inputs.shape[1]):")
    for number, instruction in enumerate(recorded.instructions):
        lines.append(f"        t{number} = {_expression(instruction)}")
    lines += [f"        outputs[{k}, k] = t{i}" for k, i in enumerate(recorded.output_results)]
    lines += [f"        c{k} = t{i}" for k, i in enumerate(recorded.carry_results)]
    lines += [f"    carry[{k}] = c{k}" for k in range(len(recorded.carry))]
    return "\n".join(lines)


def _expression(instruction) -> str:
    """One instruction as Python."""
    kind, value = instruction.kind, instruction.value
    x = [f"t{i}" for i in instruction.operands]
    if kind in ("add", "sub", "mul", "div"):
        return f"{x[0]} {_SIGNS[kind]} {x[1]}"
    if kind in _SIGNS:
        return f"1.0 if {x[0]} {_SIGNS[kind]} {x[1]} else 0.0"
    if kind in ("and", "or"):
        return f"1.0 if ({x[0]} != 0.0) {kind} ({x[1]} != 0.0) else 0.0"
    return {
        "constant": f"{float(value)!r}", "carry": f"c{value}", "input": f"inputs[{value}, k]",
        "where": "{1} if {0} != 0.0 else 0.0", "pick": "({1} if {0} != 0.0 else {2}) + 0.0",
        "not": "1.0 if {0} == 0.0 else 0.0", "neg": "-{0}", "square": "{0} * {0}", "twice": "{0} + {0}",
        "inverse": "1.0 / {0}", "sqrt": "np.sqrt({0})", "abs": "abs({0})",
    }[kind].format(*x)  # fmt: skip


def numba_loop(recorded: Recorded):
    """The loop for numba to compile at its first call."""
    import numba

    names = {"np": np}
    exec(numba_source(recorded), names)
    return numba.njit(error_model="numpy")(names["loop"])


def _columns(recorded: Recorded, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Inputs by row, flags 0 or 1, and room for the outputs."""
    rng = np.random.default_rng(1)
    inputs = rng.uniform(0.5, 4.0, (len(recorded.inputs), count))
    for k, name in enumerate(recorded.inputs):
        if name in recorded.flags:
            inputs[k] = rng.random(count) < 0.8
    return inputs, np.zeros((len(recorded.outputs), count))


def _smallest() -> Recorded:
    """A step that adds two numbers."""
    return record("small", lambda carry, given: ({}, {"sum": given["a"] + given["b"]}), [], ["a", "b"])


def _compile_by_numba(
    recorded: Recorded, columns: tuple[np.ndarray, np.ndarray], observer: cd.Observer | None = None
) -> float:
    """The time of numba's compilation and a first short run, s; the outputs are in the columns."""
    carry = np.array([observer.carry[key] for key in recorded.carry] if observer else [0.0])
    start = time.perf_counter()
    numba_loop(recorded)(*columns, carry)
    return time.perf_counter() - start


def _grid(observer: cd.Observer, recorded: Recorded, columns: tuple[np.ndarray, np.ndarray]) -> cd.Grid:
    """The inputs as a grid."""
    given = dict(zip(recorded.inputs, columns[0], strict=True))
    flags = {name: given[f"{name}_ok"] > 0 for name in observer.channels}
    time_ = np.arange(columns[0].shape[1]) * observer.dt
    return cd.Grid(time_, observer.dt, {name: given[name] for name in observer.channels}, flags, flags)
