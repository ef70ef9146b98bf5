"""Fit the numbers of src/codriver/kernel/coefficients.py: minimax polynomials and constants in parts.

python docs/measure/elementary_fit.py        prints the module; needs mpmath

A polynomial p of given length minimises the largest |w(z) (f(z) - p(z))| over an interval (Remez exchange, 60 digits); w is what
turns its error into the relative error of the function. The worst error is printed to standard error, as a power of two.
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from mpmath import mp, mpf

mp.dps = 60
Function = Callable[[mpf], mpf]
BITS = {"double": 53, "float": 24}


def remez(f: Function, weight: Function, high: mpf, length: int) -> tuple[list[mpf], mpf]:
    """The minimax polynomial on (0, high], lowest power first, and its largest weighted error."""
    count = 600
    grid = [high * (1 - mp.cos(mp.pi * (k + mpf(1) / 2) / count)) / 2 for k in range(count)]
    wanted, weights = [f(z) for z in grid], [weight(z) for z in grid]
    at = [round((count - 1) * (1 - float(mp.cos(mp.pi * k / length))) / 2) for k in range(length + 1)]
    solution, worst = [], mpf(0)
    for _ in range(12):
        rows = [[grid[i] ** k for k in range(length)] + [(-1) ** n / weights[i]] for n, i in enumerate(at)]
        solution = list(mp.lu_solve(mp.matrix(rows), mp.matrix([wanted[i] for i in at])))[:length]
        error = [w * (v - mp.polyval(solution[::-1], z)) for z, v, w in zip(grid, wanted, weights, strict=True)]
        worst = max(abs(e) for e in error)
        again = extrema(error, length + 1)
        if again == at:
            break
        at = again
    return solution, worst


def extrema(error: list[mpf], count: int) -> list[int]:
    """Places of the largest error of each sign in turn."""
    runs: list[list[int]] = []
    for k, e in enumerate(error):
        if runs and (error[runs[-1][0]] > 0) == (e > 0):
            runs[-1].append(k)
        else:
            runs.append([k])
    peaks = [max(run, key=lambda k: abs(error[k])) for run in runs]
    while len(peaks) > count:
        peaks.pop(0 if abs(error[peaks[0]]) < abs(error[peaks[-1]]) else -1)
    if len(peaks) < count:
        raise SystemExit(f"the error alternates {len(peaks)} times, {count} needed: a shorter polynomial will do")
    return peaks


def root(f: Function) -> Function:
    """A function of x as one of z = x^2."""
    return lambda z: f(mp.sqrt(z))


# name: (function of z, weight, upper end of z, coefficients in double, in float)
FITS: dict[str, tuple[Function, Function, mpf, int, int]] = {
    "sin": (root(lambda x: (mp.sin(x) / x - 1) / x**2), lambda z: z, mpf("0.6175"), 6, 3),
    "cos": (root(lambda x: (mp.cos(x) - 1 + x**2 / 2) / x**4), lambda z: z**2, mpf("0.6175"), 6, 3),
    "exp": (root(lambda x: (x / mp.tanh(x / 2) - 2) / x**2), lambda z: z * mp.sqrt(z) / 2, mpf("0.1206"), 5, 2),
    "log": (root(lambda x: (2 * mp.atanh(x) / x - 2) / x**2), lambda z: z / 2, mpf("0.02945"), 7, 3),
    "log_tail": (root(lambda x: (mp.atanh(x) / x - 1 - x**2 / 3) / x**4), lambda z: z**2, mpf("0.02945"), 8, 4),
    "atan": (root(lambda x: (mp.atan(x) / x - 1) / x**2), lambda z: z, mpf("0.1915"), 11, 5),
    "asin": (root(lambda x: (mp.asin(x) / x - 1) / x**2), lambda z: z, mpf("0.2501"), 13, 6),
}  # fmt: skip


def rounded(x: mpf, bits: int) -> mpf:
    """To the nearest number of so many bits."""
    exponent = mp.floor(mp.log(abs(x), 2)) + 1 - bits
    return mp.nint(x / mpf(2) ** exponent) * mpf(2) ** exponent


def parts(x: mpf, widths: list[int]) -> list[mpf]:
    """A number as a sum of numbers of so many bits."""
    found = []
    for bits in widths:
        found.append(rounded(x, bits))
        x -= found[-1]
    return found


def constants(bits: int) -> dict[str, list[mpf]]:
    """Constants in parts: short ones, whose product with a small whole number is exact, then full ones."""
    full = [bits, bits]
    short = 36 if bits == 53 else 12
    return {
        "two_over_pi": [rounded(2 / mp.pi, bits)],
        "half_pi_parts": parts(mp.pi / 2, [short, short, short, bits]),
        "half_pi": parts(mp.pi / 2, full),
        "atan_half": parts(mp.atan(mpf(1) / 2), full),
        "atan_one": parts(mp.pi / 4, full),
        "atan_three_halves": parts(mp.atan(mpf(3) / 2), full),
        "one_over_ln2": [rounded(1 / mp.log(2), bits)],
        "ln2": parts(mp.log(2), [bits - 12 if bits == 53 else bits - 9, bits]),
        "third": parts(mpf(1) / 3, full),
        "root_two": [rounded(mp.sqrt(2), bits)],
    }


def main() -> None:
    """Fit and print."""
    print('"""Numbers of the elementary functions, lowest power first; written by docs/measure/elementary_fit.py.')
    print("\nThe polynomials are minimax fits in z = x^2 (log: s^2); constants come in parts whose sum is the number.")
    print('"""\n\nNUMBERS: dict[str, dict[str, tuple[float, ...]]] = {')
    for column, (real, bits) in enumerate(BITS.items()):
        print(f'    "{real}": {{')
        for name, fit in FITS.items():
            found, worst = remez(*fit[:3], fit[3 + column])
            print(f"{real} {name}: worst error 2^{float(mp.log(worst, 2)):.1f}", file=sys.stderr)
            show(name, [rounded(c, bits) for c in found])
        for name, values in constants(bits).items():
            show(name, values)
        print("    },")
    print("}")


def show(name: str, values: list[mpf]) -> None:
    """One row of the module."""
    numbers = [repr(float(np.float64(float(v)))) for v in values]
    if len(numbers) < 4:
        print(f'        "{name}": ({", ".join(numbers)}{"," if len(numbers) == 1 else ""}),')
    else:
        print("\n".join([f'        "{name}": (', *(f"            {number}," for number in numbers), "        ),"]))


if __name__ == "__main__":
    main()
