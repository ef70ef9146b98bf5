"""Figures of docs/bit-contract.md on elementary functions: error against mpmath, operations, compile time, speed against libm.

python docs/measure/elementary.py [points]       points a function and a range, 20000 by default; needs mpmath; gcc for the speed
"""

# ruff: noqa: T201
from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import casadi as ca
import mpmath
import numpy as np

from codriver.kernel import Recorded, record
from codriver.kernel.c99 import print_body
from codriver.kernel.llvm import compile_loop
from codriver.kernel.reals import REALS

TWO = ("atan2", "hypot", "power")
POWERS = (0.3, 1.7, 2.5, -0.5, -3.3, 200.0)  # CasADi makes products of whole powers up to 100


def recorded(name: str, exponent: float | None = None) -> Recorded:
    """One function as a step."""
    f = getattr(ca, name)

    def step(carry: dict, given: dict) -> tuple[dict, dict]:
        second = [given["y"]] if exponent is None else [exponent]
        return {}, {"value": f(given["x"], *(second if name in TWO else []))}

    return record("f", step, [], ["x", "y"])


def evaluate(step: Recorded, real: str, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The step's operations on columns, by numpy in 64 or 32 bits, whose + - * / sqrt are IEEE's too."""
    kind = np.float64 if real == "double" else np.float32
    lowered, values = step.printed_in(real), []
    given = [x.astype(kind), y.astype(kind)]
    operations: dict[str, Callable] = {
        "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative, "sqrt": np.sqrt,
        "abs": np.abs, "square": lambda a: a * a, "twice": lambda a: a + a, "inverse": lambda a: kind(1) / a,
        "lt": np.less, "le": np.less_equal, "eq": np.equal, "ne": np.not_equal,
        "not": lambda a: a == 0, "and": lambda a, b: (a != 0) & (b != 0), "or": lambda a, b: (a != 0) | (b != 0),
        "where": lambda c, a: np.where(c != 0, a, kind(0)), "pick": lambda c, a, b: np.where(c != 0, a, b) + kind(0),
    }  # fmt: skip
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for i in lowered.instructions:
            if i.kind == "input":
                values.append(given[int(i.value)])
            elif i.kind == "constant":
                values.append(np.full(x.shape, kind(i.value)))
            else:
                values.append(np.asarray(operations[i.kind](*(values[k] for k in i.operands))).astype(kind))
    return values[lowered.output_results[0]]


def ulps(name: str, real: str, got: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Errors in units of the last place of the true value."""
    bits, lowest = (53, -1074) if real == "double" else (24, -149)
    limit = mpmath.mpf(2) ** REALS[real].top
    f = getattr(mpmath, name)
    errors = np.zeros(len(x))
    with mpmath.workprec(260):
        for k in range(len(x)):
            a, b = mpmath.mpf(float(x[k])), mpmath.mpf(float(y[k]))
            true = f(a, b) if name in TWO else f(a)
            if abs(true) >= limit:
                errors[k] = 0.0 if math.isinf(got[k]) else math.inf
                continue
            if true == 0:
                errors[k] = 0.0 if got[k] == 0 else math.inf
                continue
            place = max(mpmath.frexp(true)[1] - bits, lowest)
            errors[k] = float(abs(mpmath.mpf(float(got[k])) - true) / mpmath.mpf(2) ** place)
    return errors


def ranges(name: str, real: str, count: int, rng: np.random.Generator) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Arguments: everyday ones, the whole domain, and hard ones."""
    top = REALS[real].top
    tiny = 10.0 ** rng.uniform(-0.3 * top if real == "double" else -37, 0, count) * rng.choice([-1, 1], count)
    wide = {
        "exp": (-0.72 * top, 0.693 * top), "sinh": (-0.693 * top, 0.693 * top), "cosh": (-0.693 * top, 0.693 * top),
        "tanh": (-25, 25), "expm1": (-60, 0.693 * top), "asin": (-1, 1), "acos": (-1, 1),
    }.get(name, (-1e3, 1e3))  # fmt: skip
    zero = np.zeros(count)
    if name in ("sin", "cos", "tan"):
        circle = REALS[real].circle
        near = rng.integers(1, int(circle / 1.58), count) * (np.pi / 2)
        kind = np.float64 if real == "double" else np.float32
        near = near.astype(kind).astype(float)
        return {"-10..10": (rng.uniform(-10, 10, count), zero), "domain": (rng.uniform(-circle, circle, count), zero),
                "nearest to multiples of pi/2": (near, zero), "small": (tiny, zero)}  # fmt: skip
    if name in ("log", "log1p", "power"):
        large = 2.0 ** rng.uniform(-top + 2, top - 1, count)
        close = 1 + rng.uniform(-0.3, 0.4, count)
        found = {"0.7..1.4": (close - (name == "log1p"), zero), "domain": (large, zero), "small": (np.abs(tiny), zero)}
        if name == "power":
            found = {f"{k}, exponent {p:g}": (v[0], zero + p) for k, v in found.items() for p in POWERS}
            found = {k: v for k, v in found.items() if k.split(",")[0] != "small"}
            found["exponents to the ends"] = (large, 0.99 * top / np.log2(large) * rng.uniform(-1, 1, count))
        return found
    if name in TWO:
        return {
            "-10..10": (rng.uniform(-10, 10, count), rng.uniform(-10, 10, count)),
            "sizes": (tiny * rng.uniform(1, 10, count), tiny[::-1] * rng.uniform(1, 10, count)),
        }
    return {"-2..2": (rng.uniform(-1, 1, count) * min(2, wide[1]), zero), "wide": (rng.uniform(*wide, count), zero),
            "small": (tiny, zero)}  # fmt: skip


SMOOTH = ["sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "expm1", "log", "log1p", "power", "sinh", "cosh",
          "tanh", "hypot"]  # fmt: skip


def worst(name: str, real: str, count: int) -> dict[str, float]:
    """Largest error in each range, units of the last place."""
    rng = np.random.default_rng(3)
    found = {}
    for what, (x, y) in ranges(name, real, count, rng).items():
        kind = np.float64 if real == "double" else np.float32
        x, y = x.astype(kind).astype(float), y.astype(kind).astype(float)
        constant = name == "power" and "exponent " in what
        step = recorded(name, float(y[0]) if constant else None)
        found[what] = float(np.max(ulps(name, real, evaluate(step, real, x, y), x, y)))
    return found


def speed() -> str:
    """Nanoseconds a call in C, ours and libm's, over numbers from 0.1 to 3; and of LLVM's loop."""
    from drives import table

    rows = []
    rng = np.random.default_rng(5)
    n = 200_000
    x, y = rng.uniform(0.1, 3, n), rng.uniform(0.1, 3, n)
    cases = {f"{n}(x)": recorded(n) for n in ("sin", "exp", "log", "tanh")}
    cases |= {"atan2(x, y)": recorded("atan2"), "pow(x, y)": recorded("power")}
    friction = record(
        "f", lambda c, u: ({}, {"value": ca.sin(u["x"]) + ca.cos(u["x"]) * ca.tanh(u["y"])}), [], ["x", "y"]
    )
    cases["sin(x) + cos(x) * tanh(y)"] = friction
    for written, step in cases.items():
        call = re.sub(r"\b([xy])\b", r"in->\1", written)
        times = []
        for body in ("\n".join(print_body(step).lines), f"out->value = {call};"):
            with tempfile.TemporaryDirectory() as folder:
                source = Path(folder) / "f.c"
                source.write_text(SPEED.replace("BODY", body).replace("COUNT", str(n)))
                subprocess.run(
                    ["gcc", "-std=c99", "-O2", "-ffp-contract=off", source, "-o", f"{folder}/f", "-lm"], check=True
                )
                said = subprocess.run(
                    [f"{folder}/f"], input=np.concatenate([x, y]).tobytes(), capture_output=True, check=True
                )
                times.append(float(said.stdout))
        compiled = compile_loop(step)
        rows.append(
            [written, str(step.operations()), f"{times[0]:.0f}", f"{times[1]:.0f}", f"{loop_time(compiled, x, y):.0f}"]
        )
    return table(
        ["in a step", "operations", "exact operations, C, ns", "libm, C, ns", "exact operations, LLVM, ns"], rows
    )


def loop_time(compiled: object, x: np.ndarray, y: np.ndarray) -> float:
    """Of the compiled loop, ns a sample."""
    import ctypes

    out = np.empty_like(x)
    given = (ctypes.c_void_p * 2)(x.ctypes.data, y.ctypes.data)
    made = (ctypes.c_void_p * 1)(out.ctypes.data)
    found = []
    for _ in range(5):
        start = perf_counter()
        compiled.run(len(x), 0, ctypes.addressof(given), ctypes.addressof(made))
        found.append(perf_counter() - start)
    return 1e9 * min(found) / len(x)


SPEED = """
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <time.h>
typedef double real;
#define ZERO 0.0
static inline real pick(bool c, real yes, real no) { return (c ? yes : no) + ZERO; }
static inline real square(real x) { return x * x; }
struct input { real x, y; };
struct output { real value; };
static void __attribute__((noinline)) step(const struct input *in, struct output *out) { (void)square; (void)pick; BODY }
static double given[2 * COUNT];
int main(void)
{
    double best = 1e9, sum = 0;
    if (fread(given, sizeof(double), 2 * COUNT, stdin) != 2 * COUNT) return 1;
    for (int r = 0; r < 7; ++r) {
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        for (int k = 0; k < COUNT; ++k) {
            struct input in = { given[k], given[COUNT + k] };
            struct output out;
            step(&in, &out);
            sum += out.value;
        }
        clock_gettime(CLOCK_MONOTONIC, &b);
        const double t = (b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec);
        best = t < best ? t : best;
    }
    printf("%.3f", best / COUNT + 0 * sum);
    return 0;
}
"""


def main() -> None:
    """Measure and print."""
    from drives import table

    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    for real in REALS:
        rows = []
        for name in SMOOTH:
            start = perf_counter()
            compile_loop(recorded(name), anew=True)
            took = perf_counter() - start
            errors = worst(name, real, count)
            where = max(errors, key=errors.__getitem__)
            operations = recorded(name).printed_in(real).operations()
            rows.append([name, str(operations), f"{max(errors.values()):.2f}", where, f"{1e3 * took:.0f}"])
            print("  ", name, {k: round(v, 2) for k, v in errors.items()}, file=sys.stderr)
        print(
            f"\n{real}\n" + table(["function", "operations", "worst error, ulp", "where", "record and LLVM, ms"], rows)
        )
    if shutil.which("gcc"):
        print("\n" + speed())


if __name__ == "__main__":
    main()
