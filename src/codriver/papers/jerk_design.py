"""The design that both jerk papers share (2017 sections II-C and III, 2015 sections III and IV): what they say of it, checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from codriver.models import intention_model
from codriver.observers import design_scaled_gain
from codriver.observers.response import bandwidth, delay, jerk_response, noise_gain, settling, slope_ramp_error
from codriver.observers.scaled_gain import ScaledGain
from codriver.papers.drawing import ELL_COLORS
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import COLORS, Chart, Curve, Plot, Table
from codriver.signals.signal import Array

DT = 0.01  # s
EXACT = 1e-9  # relative difference that counts as none
# L_K found by an independent solution of the Riccati equation; rows v, a_i, o_a, j_i; columns accelerometer, speed.
GAINS = {
    "bisoffi2017": ((0.07524, 4.23639), (0.26879, 8.75654), (0.29121, -1.23264), (0.38980, 9.20902)),
    "bisoffi2015": ((0.01904, 6.24033), (0.09139, 19.65206), (0.09810, -0.61404), (0.19418, 31.02090)),
}

Designs = Mapping[float, ScaledGain]


@dataclass(frozen=True)
class Places:
    """Where a paper states what: the model, its lost observability, the scaled gain, and the scaled error."""

    model: str
    lost: str
    gain: str
    error: str
    printed_factor: str


def design_chapter(preset: str, ells: tuple[float, ...], places: Places) -> Chapter:
    """The chapter on the design, with a paper's noise and the values of the knob that it shows."""
    designs = {ell: design_scaled_gain(preset, DT, ell) for ell in ells}
    listed = ", ".join(f"{ell:g}" for ell in ells)
    model = intention_model()
    rank, split = _rank(model.A, model.C), _rank(*_offset_split(model.A, model.C))
    gain = float(np.max(np.abs(designs[ells[0]].L_K - np.array(GAINS[preset]))))
    scaling, kalman = _scaling_error(designs), _kalman_error(designs)
    fits = places.printed_factor == "diag(1, ell)"
    items = (
        Item(f"{places.model}: (C, A) is observable", "observable", f"rank {rank} of 4", "", rank == 4,
             "rank of the observability matrix"),
        Item(f"{places.lost}: with slope and bias as two states it is not", "not observable", f"rank {split} of 5", "",
             split < 5, "rank of the observability matrix, o_a split into g alpha and the bias"),
        Item("gain L_K for the paper's Q and R", None, f"agrees to {gain:.0e}", "", gain < 1e-4,
             "the paper prints none; greatest difference from an independent solution of the Riccati equation"),
        Item(f"{places.gain}: the right factor of L", places.printed_factor, "diag(1, ell)", "", fits,
             "as printed" if fits else "there are two measurements, so the printed factor does not fit; this one scales"),
        Item(f"{places.error}: ell scales all eigenvalues of the error", "exactly", scaling, "1", scaling < EXACT,
             f"greatest relative difference, ell = {listed}"),
        Item("the scaled observer is a Kalman filter itself", None, kalman, "1", kalman < EXACT,
             "not in the paper: L is the stationary gain for Q and R scaled with ell; greatest relative difference. So rows "
             "that come late or not at all can be handled exactly"),
    )  # fmt: skip
    words = (
        "The gain follows from Q and R by a Riccati equation, and the knob ell scales it. What the knob buys and costs then "
        "follows from the gains in closed form, before any drive: a large ell is quick and noisy, a small one slow and smooth.",
    )
    return Chapter("The design", words, (_price(designs), _response(designs)), items)


def _rank(A: Array, C: Array) -> int:
    return int(np.linalg.matrix_rank(np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(A.shape[0])])))


def _offset_split(A: Array, C: Array) -> tuple[Array, Array]:
    """The model with slope (state 2) and bias (state 3) as states of their own."""
    keep = [0, 1, 2, 4]
    wide, rows = np.zeros((5, 5)), np.zeros((2, 5))
    wide[np.ix_(keep, keep)], rows[:, keep] = A, C
    rows[0, 3] = 1.0
    return wide, rows


def _scaling_error(designs: Designs) -> float:
    """How far the eigenvalues of A - L C are from ell times those of A - L_K C, relative to the greatest."""
    model = intention_model()
    worst = 0.0
    for ell, design in designs.items():
        base = np.sort_complex(np.linalg.eigvals(model.A - design.L_K @ model.C))
        scaled = np.sort_complex(np.linalg.eigvals(model.A - design.L @ model.C))
        worst = max(worst, float(np.max(np.abs(scaled - ell * base)) / np.max(np.abs(scaled))))
    return worst


def _kalman_error(designs: Designs) -> float:
    """How far L is from the stationary Kalman gain for Q_ell and R_ell, relative to the greatest entry."""
    from scipy.linalg import solve_continuous_are

    model = intention_model()
    worst = 0.0
    for design in designs.values():
        P = solve_continuous_are(model.A.T, model.C.T, design.Q, design.R)
        gain = P @ model.C.T @ np.linalg.inv(design.R)
        worst = max(worst, float(np.max(np.abs(gain - design.L)) / np.max(np.abs(design.L))))
    return worst


def _price(designs: Designs) -> Table:
    """Delay, bandwidth, settling and noise at each ell."""
    rows = []
    for ell, design in designs.items():
        accelerometer, speed = noise_gain(design)
        rows.append((
            f"{ell:g}", delay(design), bandwidth(design), settling(design), accelerometer, speed, slope_ramp_error(design),
        ))  # fmt: skip
    return Table(
        ("ell", "delay, s", "−3 dB, Hz", "settling, s", "noise of y_1, 1/s", "noise of y_2, 1/s²", "rate of o_a"),
        tuple(rows),
        "Of the jerk estimate, closed forms of the continuous observer: delay at low frequency; settling to 5 %; standard "
        "deviation per that of the accelerometer's and of the speed's white samples at 100 Hz; error per rate of the offset.",
    )  # fmt: skip


def _response(designs: Designs) -> Chart:
    """From true jerk to its estimate, over frequency."""
    frequency = np.geomspace(0.02, 5.0, 200)
    gains: list[Curve] = []
    lags: list[Curve] = []
    mixed = any(ell not in ELL_COLORS for ell in designs)
    for ell, design in designs.items():
        response = jerk_response(design, frequency)
        color = COLORS[len(gains)] if mixed else ELL_COLORS[ell]
        gains.append(Curve(f"ell = {ell:g}", frequency, 20 * np.log10(np.abs(response)), color))
        phase = -np.unwrap(np.angle(response))
        lags.append(Curve("", frequency, phase / (2 * np.pi * frequency), color))
    return Chart(
        "From the true jerk to its estimate", "frequency (Hz)",
        (Plot("gain (dB)", tuple(gains), 170, (-3.0,), limits=(-30.0, 6.0)), Plot("phase delay (s)", tuple(lags), 150, (0.0,))),
        "A burst of jerk of one second has most of its content below 1 Hz: the smaller ell, the more of it is lost or late.",
        log_x=True,
    )  # fmt: skip
