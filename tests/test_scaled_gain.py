"""The gain design against the numbers of the papers' problem, in closed form and from the step that really runs."""

import numpy as np
import pytest

import codriver as cd
from codriver.errors import DesignError, UsageError
from codriver.models import intention_model
from codriver.observers import PRESETS, Preset, design_scaled_gain
from codriver.observers.response import (
    acceleration_response,
    bandwidth,
    delay,
    jerk_response,
    noise_gain,
    settling,
    slope_ramp_error,
)
from conftest import motion_log

# Riccati gains (rows v, a, o_a, j; columns acceleration, speed) and eigenvalues for the papers' Q and R.
L_K = {
    "bisoffi2017": [[0.07524, 4.23639], [0.26879, 8.75654], [0.29121, -1.23264], [0.38980, 9.20902]],
    "bisoffi2015": [[0.01904, 6.24033], [0.09139, 19.65206], [0.09810, -0.61404], [0.19418, 31.02090]],
}
EIGENVALUES = {
    "bisoffi2017": [-2.22184, -1.12987 - 1.80122j, -1.12987 + 1.80122j, -0.31481],
    "bisoffi2015": [-3.15699, -1.58641 - 2.73861j, -1.58641 + 2.73861j, -0.10000],
}
# per ell: -3 dB Hz * ell, delay s / ell, 5 % settling s / ell, noise of jerk at 100 Hz / ell^1.5 and / ell^2.5, slope ramp
RESPONSE = {
    "bisoffi2017": (0.3296, 0.911, 2.74, 0.0172, 0.351, 0.297),
    "bisoffi2015": (0.5023, 0.627, 1.88, 0.0070, 1.006, 0.310),
}
PAPERS = sorted(PRESETS)
ELLS = [0.8, 1.0, 1.4, 2.0, 3.0]


@pytest.mark.parametrize("paper", PAPERS)
def test_riccati_gain(paper):
    design = design_scaled_gain(paper, 0.01, 1.0)
    np.testing.assert_allclose(design.L_K, L_K[paper], atol=6e-6)
    np.testing.assert_allclose(
        np.sort_complex(design.certificate.eigenvalues), np.sort_complex(np.array(EIGENVALUES[paper])), atol=6e-6
    )


@pytest.mark.parametrize("paper", PAPERS)
def test_gain_agrees_with_python_control(paper):
    """The same gain from another library's Riccati solver."""
    control = pytest.importorskip("control")
    model, noise = intention_model(), PRESETS[paper]
    L, _, _ = control.lqe(model.A, np.eye(4), model.C, np.diag(noise.Q), np.diag(noise.R))
    np.testing.assert_allclose(design_scaled_gain(paper, 0.01, 1.0).L_K, L, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("ell", ELLS)
@pytest.mark.parametrize("paper", PAPERS)
def test_eigenvalues_scale(paper, ell):
    """A - L C has ell times the eigenvalues of A - L_K C (2017 eq. 18)."""
    model, design = intention_model(), design_scaled_gain(paper, 0.01, ell)
    T = np.diag([1, ell, ell, ell**2])
    scaled = np.linalg.inv(T) @ (model.A - design.L @ model.C) @ T
    np.testing.assert_allclose(scaled, ell * (model.A - design.L_K @ model.C), atol=1e-12)


@pytest.mark.parametrize("ell", ELLS)
@pytest.mark.parametrize("paper", PAPERS)
def test_scaled_observer_is_a_kalman_filter(paper, ell):
    """L is the Riccati gain for Q_ell, R_ell; the printed 4 x 4 factor would not be."""
    from scipy.linalg import solve_continuous_are

    C, design = intention_model().C, design_scaled_gain(paper, 0.01, ell)
    P = solve_continuous_are(intention_model().A.T, C.T, design.Q, design.R)
    np.testing.assert_allclose(P @ C.T @ np.linalg.inv(design.R), design.L, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize(("rate", "bound"), [(100, 2e-5), (20, 4e-4)])
@pytest.mark.parametrize("ell", ELLS)
@pytest.mark.parametrize("paper", PAPERS)
def test_poles_of_the_step(paper, ell, rate, bound):
    """The step's poles are exp(lambda dt); forward Euler misses them by far more."""
    model, design = intention_model(), design_scaled_gain(paper, 1 / rate, ell)
    wanted = np.exp(design.certificate.eigenvalues / rate)
    discrete = design.certificate.discrete_eigenvalues
    for pole in wanted:
        rate_error = np.min(np.abs(np.log(discrete) - np.log(pole))) / abs(np.log(pole))
        assert rate_error < bound
    euler = np.linalg.eigvals(np.eye(4) + (model.A - design.L @ model.C) / rate)
    worst = max(np.min(np.abs(np.log(euler) - np.log(p))) / abs(np.log(p)) for p in wanted)
    assert worst > 20 * bound


@pytest.mark.parametrize("ell", ELLS)
@pytest.mark.parametrize("paper", PAPERS)
def test_response(paper, ell):
    """Bandwidth, delay, settling, noise, slope ramp: 1 %, noise 3 %."""
    design = design_scaled_gain(paper, 0.01, ell)
    f3, late, settle, noise_a, noise_v, ramp = RESPONSE[paper]
    assert bandwidth(design) == pytest.approx(f3 * ell, rel=0.01)
    assert delay(design) == pytest.approx(late / ell, rel=0.01)
    assert settling(design) == pytest.approx(settle / ell, rel=0.01)
    assert noise_gain(design)[0] == pytest.approx(noise_a * ell**1.5, rel=0.03)
    assert noise_gain(design)[1] == pytest.approx(noise_v * ell**2.5, rel=0.03)
    assert abs(slope_ramp_error(design)) == pytest.approx(ramp, rel=0.01)
    overshoot = 20 * np.log10(np.abs(acceleration_response(design, ell * np.geomspace(0.01, 5, 2000))).max())
    assert 3.9 < overshoot < 4.6


@pytest.mark.parametrize("form", ["kalman", "constant"])
@pytest.mark.parametrize("ell", [1.0, 2.0, 3.0])
def test_running_step_has_that_response(ell, form):
    """What comes out of the compiled step for a sinusoidal jerk is what G says; the sampled filter is dt/2 quicker."""
    dt, f = 0.01, 0.1
    log, jerk = motion_log(120, dt, 0, 0)
    estimate = cd.compile(cd.build("kinematic", dt=dt, ell=ell, form=form)).run(log)
    late = slice(2000, 12000)  # whole periods, after the start
    t = estimate.time[late]
    carrier = np.exp(-2j * np.pi * f * t)
    measured = (estimate.columns["longitudinal_jerk"][late] @ carrier) / (jerk[late] @ carrier)
    G = jerk_response(design_scaled_gain("bisoffi2017", dt, ell), f)[0] * np.exp(2j * np.pi * f * dt / 2)
    assert abs(measured - G) < 0.01 * abs(G)


@pytest.mark.slow
@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.parametrize("ell", [1.0, 2.0, 3.0])
def test_running_step_has_that_noise(ell, row):
    """Noise of the jerk per unit of sensor noise, over a million samples: 3 %."""
    n, dt = 1_000_000, 0.01
    t, rng = np.arange(n) * dt, np.random.default_rng(row)
    white = rng.standard_normal(n)
    zero = np.zeros(n)
    log = cd.Log.of([
        cd.Signal("longitudinal_acceleration", t, white if row == 0 else zero, "m/s^2"),
        cd.Signal("longitudinal_speed", t, 1000 + (white if row == 1 else zero), "m/s"),
    ])  # fmt: skip
    estimate = cd.compile(cd.build("kinematic", dt=dt, ell=ell), ["longitudinal_jerk"]).run(log)
    found = estimate.columns["longitudinal_jerk"][5000:].std()
    assert found == pytest.approx(noise_gain(design_scaled_gain("bisoffi2017", dt, ell))[row], rel=0.03)


def test_noise_scaling_changes_bands_only():
    """Q and R times one factor: the same gains (the factor is learnt from the innovations)."""
    preset = PRESETS["bisoffi2017"]
    bigger = Preset(tuple(7 * q for q in preset.Q), tuple(7 * r for r in preset.R), 2.0, "test")
    one, other = design_scaled_gain(preset, 0.01), design_scaled_gain(bigger, 0.01)
    np.testing.assert_allclose(one.K, other.K, rtol=1e-8)
    np.testing.assert_allclose(7 * one.P, other.P, rtol=1e-8)


def test_model_is_observable():
    assert intention_model().observability() == 4


@pytest.mark.parametrize(("ell", "dt"), [(0, 0.01), (-1, 0.01), (float("nan"), 0.01), (2, 0), (2, -0.1)])
def test_impossible_designs(ell, dt):
    with pytest.raises((UsageError, DesignError)):
        design_scaled_gain("bisoffi2017", dt, ell)


def test_unknown_preset():
    with pytest.raises(UsageError, match="one of bisoffi2017, bisoffi2015"):
        design_scaled_gain("bisoffi2016", 0.01)
