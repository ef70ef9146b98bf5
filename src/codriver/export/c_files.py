"""Write a program as C99: header, source, check program with golden vectors, README, Makefile.

No heap, no recursion, no library but math.h's sqrt and fabs. One function sets the state to its start, one takes a step.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from codriver.errors import UsageError
from codriver.export.golden import golden_inputs
from codriver.export.templates import check_source, makefile, readme
from codriver.kernel.c99 import number, print_body
from codriver.names import VOCABULARY
from codriver.program import Program

# What a float step may be off a double one, relative to max(1, |value|); measured on the golden vectors of the four
# estimators at 100 Hz and ell = 2: docs/bit-contract.md.
FLOAT_TOLERANCE = 2e-3
_NO_STATE = ("char", "unused", "C99 has no empty structs")

_HELPERS = {
    "pick": ["/* Adding 0 turns -0 into 0, so that every implementation of the step agrees on the sign of a zero. */",
             "static real pick(bool condition, real yes, real no)", "{", "    return (condition ? yes : no) + ZERO;", "}"],
    "square": ["static real square(real x)", "{", "    return x * x;", "}"],
}  # fmt: skip


def export_c(program: Program, folder: str | Path, real: str = "double") -> list[Path]:
    """Write the C99 of a program into a folder.

    The folder is written whole or not at all: everything goes to a temporary folder first.

    Args:
        program: compiled with the outputs wanted.
        folder: is created; the files of an earlier export of the same observer in it are replaced.
        real: "double" (bit-exact with codriver) or "float" (compared with a tolerance).

    Returns:
        the files written.

    Raises:
        UsageError: `real` is neither, the folder cannot be written, or it holds files of these names that are not such
            an export.
    """
    if real not in ("double", "float"):
        raise UsageError(f"real = '{real}'", "'double' or 'float'", "choose one")
    folder = Path(folder)
    name = program.recorded.name
    files = {
        f"{name}.h": _header(program, real),
        f"{name}.c": _source(program, real),
        f"{name}_check.c": check_source(name, real, _golden_text(program), FLOAT_TOLERANCE),
        "Makefile": makefile(name),
        "README.md": readme(
            program.observer, name, real, program.recorded.printed_in(real).operations(), FLOAT_TOLERANCE
        ),
    }
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.exists() and not folder.is_dir():
            raise NotADirectoryError(f"{folder} is a file")
        _refuse_foreign(folder, list(files), f"{name}.h", _first_words(program))
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".codriver-") as scratch:
            for file, text in files.items():
                (Path(scratch) / file).write_text(text, encoding="utf-8")
            folder.mkdir(exist_ok=True)
            for file in files:
                shutil.move(str(Path(scratch) / file), folder / file)
    except OSError as error:
        raise UsageError(
            f"cannot write {folder}: {error}", "a folder that can be written", "choose another -o"
        ) from None
    return [folder / file for file in files]


def _first_words(program: Program) -> str:
    """What the header begins with."""
    return f"/* {program.observer.name}:"


def _refuse_foreign(folder: Path, files: Sequence[str], header: str, first: str) -> None:
    """Files are replaced only where an earlier export of the same observer wrote them: its header tells.

    Raises:
        UsageError: they are somebody else's.
    """
    there = [file for file in files if (folder / file).exists()]
    if not there:
        return
    mark = folder / header
    if not mark.is_file() or not mark.read_bytes().startswith(first.encode()):
        raise UsageError(
            f"{folder} holds {', '.join(there)}, not written by an export of this estimator",
            "a folder that is new, without files of these names, or an earlier export's",
            "choose another -o",
        )


def _describe(channel: str) -> str:
    entry = VOCABULARY.get(channel)
    return f"{entry.unit}; {entry.meaning}" if entry else ""


def _struct(kind: str, name: str, rows: Sequence[tuple[str, str, str]]) -> list[str]:
    width = max((len(f"{t} {n};") for t, n, _ in rows), default=0)
    lines = [f"typedef struct {name}_{kind} {{"]
    lines += [f"    {f'{t} {n};':<{width}}  /* {comment} */" if comment else f"    {t} {n};" for t, n, comment in rows]
    return [*lines, f"}} {name}_{kind};", ""]


def _header(program: Program, real: str) -> str:
    observer, recorded = program.observer, program.recorded
    name = recorded.name
    guard = f"CODRIVER_{name.upper()}_H"
    settings = ", ".join(f"{key} = {value}" for key, value in observer.settings.items())
    inputs = []
    for channel in observer.channels:
        inputs.append((name_type(name), channel, _describe(channel)))
        for flag in observer.flags:
            note = "arrived since the last step" if flag.kind == "fresh" else "known"
            if flag.channel == channel:
                inputs.append(("bool", flag.name, f"{note}; if false, the value is not looked at"))
    kept = [o for o in observer.outputs if o.name in recorded.outputs]
    lines = [
        f"{_first_words(program)} {settings}", f" * One step every {observer.dt:g} s. SI units, axes of ISO 8855.", " */",
        f"#ifndef {guard}", f"#define {guard}", "", "#include <stdbool.h>", "", f"typedef {real} {name_type(name)};", "",
        "/* Carried from step to step; nothing else is remembered. */",
        *_struct("state", name, [(name_type(name), key, "") for key in recorded.carry] or [_NO_STATE]),
        *_struct("input", name, inputs),
        *_struct("output", name, [(name_type(name), o.name, f"{o.unit}; {o.meaning}") for o in kept]),
        f"void {name}_start({name}_state *s);", "",
        f"void {name}_step({name}_state *s, const {name}_input *in, {name}_output *out);", "", f"#endif /* {guard} */", "",
    ]  # fmt: skip
    return "\n".join(lines)


def name_type(name: str) -> str:
    """The type of numbers in the header."""
    return f"{name}_real"


def _source(program: Program, real: str) -> str:
    observer, recorded = program.observer, program.recorded.printed_in(real)
    name = recorded.name
    body = print_body(recorded, real)
    start = [number(observer.carry[key], real) for key in recorded.carry]
    # sqrt, fabs, NAN and INFINITY
    numbers = [*start, *(number(i.value, real) for i in recorded.instructions if i.kind == "constant")]
    math = any(i.kind in ("sqrt", "abs") for i in recorded.instructions) or any("N" in n for n in numbers)
    lines = [
        f"/* {observer.name}: one step is {recorded.operations()} operations, in an order that must not be changed:",
        " * compile with -ffp-contract=off, and gcc 12 for a target with FMA also with -fno-tree-slp-vectorize.", " */",
        f'#include "{name}.h"', "", *(["#include <math.h>", ""] if math else []),
        "#if defined(__clang__)", "#pragma STDC FP_CONTRACT OFF", "#endif", "",
        f"typedef {name_type(name)} real;", "", f"#define ZERO {number(0.0, real)}", "",
    ]  # fmt: skip
    for helper in sorted(body.helpers):
        lines += [*_HELPERS[helper], ""]
    lines += [f"void {name}_start({name}_state *s)", "{"]
    lines += [f"    s->{key} = {value};" for key, value in zip(recorded.carry, start, strict=True)]
    lines += [] if recorded.carry else ["    s->unused = 0;"]
    lines += ["}", "", f"void {name}_step({name}_state *s, const {name}_input *in, {name}_output *out)", "{"]
    lines += [f"    {line}" for line in (body.lines if recorded.carry else ("(void)s;", *body.lines))]
    return "\n".join([*lines, "}", ""])


def _exactly(value: float) -> str:
    """A number in hexadecimal; what is not finite by its name in C."""
    return value.hex() if isfinite(value) else number(value, "double")


def _golden_text(program: Program) -> dict[str, str]:
    """Rows of the golden vectors as C initialisers with hexadecimal floats."""
    recorded = program.recorded
    grid = golden_inputs(program)
    results = program.run_grid(grid)
    observer = program.observer
    flags = {f.name: column for f, column in zip(observer.flags, observer.flag_columns(grid), strict=True)}
    of = {channel: [f.name for f in observer.flags if f.channel == channel] for channel in observer.channels}
    rows_in, rows_out = [], []
    for k in range(len(grid)):
        fields = []
        for channel, flagged in of.items():
            fields += [
                float(grid.values[channel][k]).hex(),
                *("true" if flags[name][k] else "false" for name in flagged),
            ]
        rows_in.append("    { " + ", ".join(fields) + " },")
        rows_out.append("    { " + ", ".join(_exactly(float(results[n][k])) for n in recorded.outputs) + " },")
    names = ", ".join(f'"{n}"' for n in recorded.outputs)
    return {
        "inputs": "\n".join(rows_in),
        "outputs": "\n".join(rows_out),
        "names": names,
        "width": str(len(recorded.outputs)),
    }
