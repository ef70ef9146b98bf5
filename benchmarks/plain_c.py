"""Plain C to measure against: the exported step in a loop over columns, and an observer as one writes it by hand."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from codriver.export import export_c
from codriver.program import Program

# Results must keep their bits, so no flag that lets the compiler fuse or reorder.
FLAGS = ("-O3", "-std=c99", "-ffp-contract=off")
NATIVE = (*FLAGS, "-march=native", "-fno-tree-slp-vectorize")


def compiler() -> str | None:
    """gcc, or None where it is not installed."""
    return shutil.which("gcc")


def version() -> str:
    """What gcc calls itself."""
    gcc = compiler()
    if gcc is None:
        return "gcc not installed"
    return subprocess.run([gcc, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]


def shared(source: str, folder: Path, name: str, flags: Sequence[str] = FLAGS) -> ctypes.CDLL:
    """Compile C text as a shared library and load it."""
    file, library = folder / f"{name}.c", folder / f"{name}.so"
    file.write_text(source, encoding="utf-8")
    gcc = compiler()
    assert gcc is not None
    subprocess.run([gcc, *flags, "-fPIC", "-shared", "-o", str(library), str(file), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def exported(program: Program, folder: Path, flags: Sequence[str] = FLAGS) -> Callable[..., None]:
    """The loop of a program's exported C: run(n, columns, flags, outputs), lists of arrays.

    Step and loop are one translation unit, so that the compiler may put the step into the loop.
    """
    folder.mkdir(exist_ok=True)
    export_c(program, folder)
    name, channels, outputs = program.recorded.name, program.observer.channels, program.recorded.outputs
    lines = [f'#include "{name}.c"', "void run(long n, double **in, unsigned char **ok, double **out)", "{"]
    lines += [f"    {name}_state s;", f"    {name}_input i;", f"    {name}_output o;", f"    {name}_start(&s);"]
    lines += [f"    const double *restrict c{k} = in[{k}];" for k in range(len(channels))]
    lines += [f"    const unsigned char *restrict f{k} = ok[{k}];" for k in range(len(channels))]
    lines += [f"    double *restrict o{k} = out[{k}];" for k in range(len(outputs))]
    lines += ["    for (long k = 0; k < n; ++k) {"]
    lines += [f"        i.{c} = c{k}[k]; i.{c}_ok = f{k}[k];" for k, c in enumerate(channels)]
    lines += [f"        {name}_step(&s, &i, &o);"]
    lines += [f"        o{k}[k] = o.{c};" for k, c in enumerate(outputs)]
    return loop("\n".join([*lines, "    }", "}", ""]), folder, "loop", flags)


_BY_HAND = """
static const double F[4][4] = %s;
static const double K[4][2] = %s;

/* x = F x + K ok (y - C F x); rows: acceleration = x1 + x2, speed = x0. The state starts at the first rows. */
void run(long n, double **in, unsigned char **ok, double **out)
{
    const double *restrict a = in[0], *restrict v = in[1];
    const unsigned char *restrict has_a = ok[0], *restrict has_v = ok[1];
    double *restrict o0 = out[0], *restrict o1 = out[1], *restrict o2 = out[2], *restrict o3 = out[3];
    double x[4] = { v[0], 0.0, a[0], 0.0 };
    o0[0] = x[0]; o1[0] = x[1]; o2[0] = x[2]; o3[0] = x[3];
    for (long k = 1; k < n; ++k) {
        double p[4], e[2];
        for (int i = 0; i < 4; ++i) {
            p[i] = 0.0;
            for (int j = 0; j < 4; ++j)
                p[i] += F[i][j] * x[j];
        }
        e[0] = has_a[k] ? a[k] - (p[1] + p[2]) : 0.0;
        e[1] = has_v[k] ? v[k] - p[0] : 0.0;
        for (int i = 0; i < 4; ++i)
            x[i] = p[i] + (K[i][0] * e[0] + K[i][1] * e[1]);
        o0[k] = x[0]; o1[k] = x[1]; o2[k] = x[2]; o3[k] = x[3];
    }
}
"""


def by_hand(F: np.ndarray, K: np.ndarray, folder: Path, flags: Sequence[str] = FLAGS) -> Callable[..., None]:
    """The constant-gain observer in matrix form, as one writes it by hand: no start, no standstill, no bands."""
    F_text, K_text = (
        "{ " + ", ".join("{ " + ", ".join(float(x).hex() for x in row) + " }" for row in M) + " }" for M in (F, K)
    )
    return loop(_BY_HAND % (F_text, K_text), folder, "by_hand", flags)


def loop(source: str, folder: Path, name: str, flags: Sequence[str] = FLAGS) -> Callable[..., None]:
    """The function `run` of C text as run(n, columns, flags, outputs), lists of arrays."""
    folder.mkdir(exist_ok=True)
    return _caller(shared(source, folder, name + "_native" * (flags is NATIVE), flags))


def _caller(library: ctypes.CDLL) -> Callable[..., None]:
    """The library's `run` on lists of arrays."""

    def pointers(arrays: Sequence[np.ndarray]) -> ctypes.Array:
        return (ctypes.c_void_p * len(arrays))(*[array.ctypes.data for array in arrays])

    def run(n: int, columns: Sequence[np.ndarray], flags: Sequence[np.ndarray], outputs: Sequence[np.ndarray]) -> None:
        library.run(ctypes.c_long(n), pointers(columns), pointers(flags), pointers(outputs))

    return run
