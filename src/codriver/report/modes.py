"""Report of a two-wheeler's modes: roots against speed, root locus, and where it is stable, in words."""

from __future__ import annotations

from math import pi

import numpy as np

from codriver.models.modes import ROOTS, Modes
from codriver.report.document import COLORS, Chart, Curve, Document, Findings, Part, Plot, Section, Span, Table
from codriver.signals.signal import Array
from codriver.vehicles import Parameter, Vehicle

MEANING = {
    "weave": "roll, yaw and steer swing together",
    "capsize": "it leans ever more to one side",
    "wobble": "the front end flutters about the steer axis",
    "caster": "the front end turns into its direction of travel",
    "rear wobble": "yaw and lateral motion on the tyres' springs",
}
COLOR = dict(zip(MEANING, COLORS, strict=False))
AT = 9  # speeds of the table, at most about so many
APART = 0.04  # of the plot: labels closer than that are left out
CLOSE = 12.0  # 1/s: real parts from minus this are what the first chart shows


def range_words(ranges: tuple[tuple[float, float], ...], low: float, high: float) -> str:
    """Ranges of speed in words, in m/s and km/h.

    Args:
        ranges: from and to, m/s.
        low, high: all that was looked at, m/s.
    """
    if not ranges:
        return f"at no speed from {_both(low, high)}"
    if ranges == ((low, high),):
        return f"at all speeds from {_both(low, high)}"
    return " and ".join(f"from {_both(*ends)}" for ends in ranges)


def mode_sentences(modes: Modes) -> list[tuple[str, str]]:
    """Severity and sentence: of the whole, then of each mode."""
    low, high = float(modes.speeds[0]), float(modes.speeds[-1])
    whole = modes.stable_ranges()
    rides = "Stable without the rider's control"
    told = [("ok" if whole else "warn", f"{rides} {range_words(whole, low, high)}.")]
    for name in modes.modes:
        ranges, growth = modes.stable_ranges(name), modes.growth(name)
        k = int(np.argmax(growth))
        worst = f"largest real part {growth[k]:+.3g} 1/s at {modes.speeds[k]:.1f} m/s"
        roots = modes.of(name)[k]
        swing = float(np.abs(roots.imag).max())
        if swing > 1e-6:
            worst += f", {swing / (2 * pi):.2g} Hz"
        elif growth[k] > 0:
            worst += f", doubles in {np.log(2) / growth[k]:.2g} s"
        whole_range = ranges == ((low, high),)
        text = f"{name} ({MEANING[name]}) is stable {range_words(ranges, low, high)}; {worst}."
        told.append(("ok" if whole_range else "warn", text[0].upper() + text[1:]))
    for names, ends in _together(modes).items():
        told.append(
            ("warn", f"{' and '.join(names)} are one pair between {_both(*ends)}, and cannot be told apart there.")
        )
    return told


def mode_rows(modes: Modes) -> list[tuple[str, ...]]:
    """Speeds, and the root of each mode there: m/s, km/h, then 1/s with rad/s."""
    rows = []
    for k in _round_speeds(modes):
        v = float(modes.speeds[k])
        rows.append((f"{v:.4g}", f"{3.6 * v:.3g}", *(_roots(modes.of(name)[k]) for name in modes.modes)))
    return rows


def modes_document(modes: Modes, vehicle: Vehicle, kind: str, command: str = "") -> Document:
    """The page of `codriver plot modes`.

    Args:
        modes: what was found.
        vehicle: whose they are.
        kind: the model, in words.
        command: that made it.
    """
    low, high = float(modes.speeds[0]), float(modes.speeds[-1])
    head = ("m/s", "km/h", *(f"{name}, 1/s" for name in modes.modes))
    rows = tuple((p.name, _value(p), p.unit, p.source) for p in vehicle.parameters.values())
    parts: tuple[Part, ...] = (Findings(tuple(mode_sentences(modes))),)
    return Document(
        f"Modes of {vehicle.name}",
        f"{vehicle.title}. What it does by itself, riding straight ahead, nobody holding the handlebar: {kind}.",
        (
            Section("Where it is stable", parts),
            Section("Against speed", (_against_speed(modes), _near_zero(modes))),
            Section("Root locus", (_locus(modes),)),
            Section(
                "Roots",
                (
                    Table(head, tuple(mode_rows(modes)), "Real part ± imaginary part, rad/s; two numbers where a pair has "
                          "met the real axis."),
                ),
            ),
            Section("Where the numbers come from", (vehicle.source, Table(("parameter", "value", "unit", "source"), rows))),
        ),
        (
            ("vehicle", vehicle.name), ("speeds", _both(low, high)),
            ("stable without control", range_words(modes.stable_ranges(), low, high)),
        ),
        command,
    )  # fmt: skip


def _against_speed(modes: Modes) -> Chart:
    """Real and imaginary parts."""
    real = tuple(c for name in modes.modes for c in _curves(modes, name, modes.of(name).real))
    swinging = [name for name in modes.modes if np.abs(modes.of(name).imag).max() > 1e-6]
    imaginary = tuple(
        c for name in swinging for c in _curves(modes, name, np.abs(modes.of(name).imag) / (2 * pi), single=True)
    )
    plots = [Plot("real part (1/s)", real, 300, (0.0,))]
    if imaginary:
        plots.append(Plot("frequency (Hz)", imaginary, 220))
    return Chart(
        "Real part and frequency", "speed (m/s)", tuple(plots), "Below 0 a mode dies out. Shaded: stable without control.",
        spans=_stable_spans(modes),
    )  # fmt: skip


def _near_zero(modes: Modes) -> Chart:
    """The real parts that decide."""
    curves = tuple(
        c for name in modes.modes for c in _curves(modes, name, modes.of(name).real) if np.nanmax(c.y) > -CLOSE
    )
    top = float(max(modes.growth().max(), 0.0))
    return Chart(
        "The same near zero", "speed (m/s)", (Plot("real part (1/s)", curves, 280, (0.0,), limits=(-CLOSE, top + 1.0)),),
        spans=_stable_spans(modes),
    )  # fmt: skip


def _locus(modes: Modes) -> Chart:
    """The roots in the upper half plane, with speeds beside them."""
    curves = []
    marks = _round_speeds(modes)
    for name in modes.modes:
        roots = modes.of(name)
        if np.abs(roots.imag).max() <= 1e-6:
            continue
        upper = np.where(roots.imag > 1e-6, roots, np.nan + 0j)
        best = np.where(np.isfinite(upper.real), upper.imag, -np.inf).argmax(axis=1)
        line = np.take_along_axis(upper, best[:, None], 1)[:, 0]
        curves.append(Curve(name, line.real, line.imag, COLOR[name]))
        there = [k for k in marks if np.isfinite(line[k].real)]
        text = _labels(line[there], [f"{modes.speeds[k]:.3g}" for k in there])
        curves.append(Curve("", line[there].real, line[there].imag, COLOR[name], "points", width=2.0, text=text))
    for name in modes.modes:
        roots = modes.of(name)
        alone = np.where(np.abs(roots.imag) <= 1e-6, roots.real, np.nan)
        for column in alone.T:
            if np.isfinite(column).any():
                curves.append(Curve("", column, np.zeros(column.size), COLOR[name], width=3.0, faint=True))
    swinging = modes.roots.real[np.abs(modes.roots.imag) > 1e-6]
    left = min(float(swinging.min()), -CLOSE) - 2.0 if swinging.size else -CLOSE
    shown = [_clipped(c, left, float(max(modes.growth().max(), 0.0)) + 1.0) for c in curves]
    return Chart(
        "Root locus", "real part (1/s)", (Plot("imaginary part (rad/s)", tuple(shown), 420, (0.0,)),),
        "Upper half; numbers are speeds in m/s. Single roots lie on the axis, those far to the left are left out.",
    )  # fmt: skip


def _together(modes: Modes) -> dict[tuple[str, ...], tuple[float, float]]:
    """Modes that make a pair with one another, and between which speeds, m/s."""
    found: dict[tuple[str, ...], tuple[float, float]] = {}
    for k, v in enumerate(modes.speeds):
        for i, other in modes.shared(k).items():
            names = tuple(sorted((modes.names[i], other)))
            found[names] = (found.get(names, (float(v), 0.0))[0], float(v))
    return found


def _round_speeds(modes: Modes) -> list[int]:
    """Where the speed is a round number; the ends too."""
    low, high = float(modes.speeds[0]), float(modes.speeds[-1])
    step = next(s for s in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50) if (high - low) / s <= AT)
    inner = [s * step for s in range(int(low / step) + 1, int(np.ceil(high / step)))]
    return sorted({int(np.argmin(np.abs(modes.speeds - v))) for v in (low, *inner, high)})


def _labels(roots: ROOTS, words: list[str]) -> tuple[str, ...]:
    """Words for points, empty where one stands close by already."""
    size = max(float(np.abs(roots).max(initial=0.0)), 1e-9)
    kept: list[complex] = []
    shown = []
    for root, word in zip(roots, words, strict=True):
        free = all(abs(root - other) > APART * size for other in kept)
        shown.append(word if free else "")
        kept += [complex(root)] if free else []
    return tuple(shown)


def _clipped(curve: Curve, low: float, high: float) -> Curve:
    """A curve without what lies to the left or right."""
    x = np.asarray(curve.x, dtype=float)
    keep = (x >= low) & (x <= high)
    if curve.kind == "points":
        text = tuple(word for word, kept in zip(curve.text, keep, strict=True) if kept)
        return Curve(curve.name, x[keep], curve.y[keep], curve.color, "points", width=curve.width, text=text)
    return Curve(curve.name, np.where(keep, x, np.nan), curve.y, curve.color, width=curve.width, faint=curve.faint)


def _curves(modes: Modes, name: str, values: Array, single: bool = False) -> list[Curve]:
    """A mode's columns over speed; one line where a pair shares its values."""
    columns = [values.max(axis=1)] if single else list(np.unique(np.sort(values, axis=1).round(9), axis=1).T)
    return [
        Curve(name if i == len(columns) - 1 else "", modes.speeds, column, COLOR[name])
        for i, column in enumerate(columns)
    ]


def _stable_spans(modes: Modes) -> tuple[Span, ...]:
    """Where it is stable without control."""
    return tuple(Span(a, b, "other") for a, b in modes.stable_ranges())


def _both(low: float, high: float) -> str:
    """A range of speed in both units."""
    return f"{low:.2f} to {high:.2f} m/s ({3.6 * low:.1f} to {3.6 * high:.1f} km/h)"


def _roots(roots: ROOTS) -> str:
    """A mode's roots at one speed."""
    swing = float(np.abs(roots.imag).max())
    if swing > 1e-6:
        return f"{roots.real.max():.3g} ± {swing:.3g}i"
    return ", ".join(f"{x:.3g}" for x in sorted(roots.real, reverse=True))


def _value(parameter: Parameter) -> str:
    """A parameter's number or numbers."""
    numbers = parameter.value if isinstance(parameter.value, tuple) else (parameter.value,)
    return ", ".join(f"{x:.4g}" for x in numbers)
