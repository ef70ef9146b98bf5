"""The bicycle's model against the paper's printed numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.models import BicycleParameters, bicycle_matrices, bicycle_model

# Meijaard et al. 2007, table 1.
BENCHMARK = BicycleParameters(
    w=1.02, c=0.08, lam=np.pi / 10, g=9.81,
    rR=0.3, mR=2, IRxx=0.0603, IRyy=0.12,
    xB=0.3, zB=-0.9, mB=85, IBxx=9.2, IBxz=2.4, IBzz=2.8,
    xH=0.9, zH=-0.7, mH=4, IHxx=0.05892, IHxz=-0.00756, IHzz=0.00708,
    rF=0.35, mF=3, IFxx=0.1405, IFyy=0.28,
)  # fmt: skip
# Table 2: real eigenvalues, and the weave's real and imaginary part.
EIGENVALUES = {
    4.0: ((-12.15861426576447, -1.42944427361326), (0.41325331521125, 3.07910818603206)),
    5.0: ((-14.07838969279822, -0.32286642900409), (-0.77534188219585, 4.46486771378823)),
    10.0: ((-24.62459635017404, 0.16105338653172), (-3.72016840437287, 10.90681139476287)),
}


class TestModel:
    def test_printed_matrices(self):
        """Section 5.3 of the paper, to the last printed digit."""
        m = bicycle_matrices(BENCHMARK)
        close = {"rtol": 0, "atol": 6e-14}
        assert np.allclose(m.M, [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]], **close)
        assert np.allclose(m.C1, [[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]], **close)
        assert np.allclose(m.K0, [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]], **close)
        assert np.allclose(m.K2, [[0, 76.59734589573222], [0, 2.65431523794604]], **close)

    @pytest.mark.parametrize("speed", EIGENVALUES)
    def test_printed_eigenvalues(self, speed):
        (fast, slow), (real, imaginary) = EIGENVALUES[speed]
        found = np.linalg.eigvals(bicycle_model(bicycle_matrices(BENCHMARK).to_iso(), speed).A)
        expected = [fast, slow, real + 1j * imaginary, real - 1j * imaginary]
        assert np.allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12, atol=1e-11)

    def test_standing_still(self):
        found = np.linalg.eigvals(bicycle_model(bicycle_matrices(BENCHMARK), 0.0).A)
        assert np.allclose(np.sort(found.real), [-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393],
                           rtol=0, atol=1e-12)  # fmt: skip

    def test_another_bicycle(self):
        """The bicycle of TU Delft's recordings, matrices by the package BicycleParameters 1.5.2."""
        m = bicycle_matrices(STEER_BY_WIRE)
        assert np.allclose(m.M, [[13.6693, 0.6679], [0.6679, 0.1401]], atol=5e-5)
        assert np.allclose(m.C1, [[0, 9.4986], [-0.4117, 0.8063]], atol=5e-5)
        assert np.allclose(m.K0, [[-19.1078, -0.9604], [-0.9604, -0.3]], atol=5e-5)
        assert np.allclose(m.K2, [[0, 18.2892], [0, 0.9862]], atol=5e-5)

    def test_signs_are_iso(self):
        """A bicycle that falls to the right steers to the right, which is negative; torque to the left steers left."""
        model = bicycle_model(bicycle_matrices(BENCHMARK).to_iso(), 5.0)
        assert all(name in cd.names.VOCABULARY for name in (*model.states, *model.inputs, *model.outputs))
        steering = model.states.index("steer_rate")
        assert model.A[steering, model.states.index("roll_angle")] < 0
        assert model.B[steering, model.inputs.index("rider_torque")] > 0
        assert model.B[model.states.index("roll_rate"), model.inputs.index("roll_moment")] > 0

    def test_steady_turn(self):
        """A left turn (steer > 0) leans left (roll < 0) by about v^2 / (g R), held by a steady torque."""
        matrices, v = bicycle_matrices(BENCHMARK).to_iso(), 5.0
        _, _, K = matrices.at(v)
        steer = 0.02
        lean = -K[0, 1] * steer / K[0, 0]
        curvature = steer * np.cos(BENCHMARK.lam) / BENCHMARK.w
        assert lean < 0
        assert lean == pytest.approx(-(v**2) * curvature / BENCHMARK.g, rel=0.05)
        held = bicycle_model(matrices, v)
        torque = K[1] @ [lean, steer]
        assert np.allclose(held.A @ [lean, steer, 0, 0] + held.B @ [0, torque], 0, atol=1e-12)

    def test_heavier_rider_needs_more(self):
        light, heavy = (bicycle_matrices(replace(BENCHMARK, mB=m)) for m in (60, 100))
        assert heavy.K0[0, 0] < light.K0[0, 0] < 0


# Riderless steer-by-wire bicycle of TU Delft, K. Pasma, MSc thesis 2024, in github.com/mechmotum/sbw_bicycle_with_model_matching.
STEER_BY_WIRE = BicycleParameters(
    w=1.036, c=0.0803, lam=np.deg2rad(18.2),
    rR=0.3498, mR=10.12, IRxx=0.1040, IRyy=0.1641,
    xB=0.462, zB=-0.698, mB=20.9, IBxx=1.64, IBxz=0.654, IBzz=1.94,
    xH=0.944, zH=-0.595, mH=0.6, IHxx=0.0098, IHxz=-0.00044, IHzz=0.00396,
    rF=0.3498, mF=1.78, IFxx=0.0644, IFyy=0.1289,
)  # fmt: skip
