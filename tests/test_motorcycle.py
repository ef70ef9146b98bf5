"""Sharp's motorcycle against the paper's printed roots, its polytope, and the bicycle's vehicle files."""

from __future__ import annotations

import numpy as np
import pytest

import codriver as cd
from codriver.models import LPV, BicycleParameters, MotorcycleParameters, bicycle_lpv, bicycle_matrices, bicycle_model
from codriver.models.motorcycle import LETTERS, MEASURED, motorcycle_coefficients, motorcycle_matrices, motorcycle_model
from test_bicycle import BENCHMARK, STEER_BY_WIRE

FOOT = 0.3048
# Sharp 1971, tables 1 to 3, standard machine, model 1: ft/s: capsize; weave; wobble, 1/s and rad/s.
PRINTED = {
    10: (-3.56, 2.01, 1.63, -5.20, 55.7), 20: (-2.83, -0.18, 2.09, -5.91, 55.8), 30: (-0.13, -3.36, 4.56, -6.42, 55.5),
    50: (0.08, -6.59, 11.4, -6.52, 54.6), 70: (0.08, -3.97, 16.8, -5.70, 54.0), 100: (0.07, -1.82, 19.2, -3.94, 54.3),
    130: (0.05, -1.13, 20.4, -2.24, 55.6), 160: (0.04, -0.96, 21.2, -0.82, 57.5),
}  # fmt: skip


@pytest.fixture(scope="module")
def sharp() -> MotorcycleParameters:
    return MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))


def nearest_to(roots: np.ndarray, wanted: complex) -> float:
    return float(np.abs(roots - wanted).min())


class TestModel:
    def test_coefficients(self, sharp):
        q = motorcycle_coefficients(sharp)
        expected = {"m33": 248.10, "m34": 26.169, "m35": 148.20, "m36": 0.7473, "m44": 44.020, "m45": 10.170, "m46": 1.0319,
                    "m55": 121.37, "m56": 0.5499, "m66": 0.4602}  # fmt: skip
        for name, value in expected.items():
            assert q[name] == pytest.approx(value, rel=2e-4), name
        assert q["r86"] == 0

    @pytest.mark.parametrize("speed", PRINTED)
    def test_printed_roots(self, sharp, speed):
        """All forty, to the last printed digit or so: 0.01 1/s where two decimals are printed, 0.05 rad/s where one is."""
        capsize, weave, weave_im, wobble, wobble_im = PRINTED[speed]
        roots = np.linalg.eigvals(motorcycle_model(sharp).A(speed * FOOT))
        for re, im in ((capsize, 0.0), (weave, weave_im), (wobble, wobble_im)):
            found = roots[np.argmin(np.abs(roots - (re + 1j * im)))]
            assert found.real == pytest.approx(re, abs=0.0065), (speed, re)
            assert found.imag == pytest.approx(im, abs=0.052), (speed, im)

    def test_roots_at_100_feet(self, sharp):
        roots = np.linalg.eigvals(motorcycle_model(sharp).A(30.48))
        for wanted in (-1.818 + 19.23j, -3.938 + 54.27j, 0.0645):
            assert nearest_to(roots, wanted) < 6e-3

    @pytest.mark.parametrize("letter", ["f", "Crxz"])
    def test_a_wrong_sign_shows(self, sharp, letter):
        from dataclasses import replace

        wrong = replace(sharp, **{letter: -getattr(sharp, letter)})
        roots = np.linalg.eigvals(motorcycle_model(wrong).A(100 * FOOT))
        assert max(nearest_to(roots, w) for w in (-1.818 + 19.23j, -3.938 + 54.27j, 0.0645)) > 0.05

    def test_signs_are_iso(self, sharp):
        """A steady left turn: steer, yaw and forces to the left, lean to the left, and the forces carry the turn."""
        model, v, r = motorcycle_model(sharp), 15.0, 0.3
        m = motorcycle_matrices(sharp)
        assert all(name in cd.names.VOCABULARY for name in (*model.states, *model.inputs, *model.outputs))
        assert model.outputs == MEASURED
        # unknown: phi, delta, v_y, Y_f, Y_r, tau; known: r, and rates that are zero
        A = m.A0 + v * m.A1
        system = np.hstack([A[:, [0, 1, 2, 6, 7]], m.B])[2:]
        phi, delta, _, front, rear, _ = np.linalg.solve(system, -A[2:, 3] * r)
        assert delta > 0
        assert front > 0
        assert rear > 0
        assert front + rear == pytest.approx(sharp.mass * v * r)
        # by hand: moments about the wheels' line; r54 < 0 leans into the turn, the steered front end takes a little off
        q = motorcycle_coefficients(sharp)
        assert phi == pytest.approx((q["r54"] * v * r + q["r52"] * delta) / q["r51"], rel=1e-12)
        assert phi == pytest.approx(-v * r / 9.81, rel=0.12)

    def test_torque_to_the_left_steers_left(self, sharp):
        model = motorcycle_model(sharp)
        assert model.B[model.states.index("steer_rate"), 0] > 0
        assert model.B[model.states.index("roll_rate"), 0] != 0

    def test_mass_matrix(self, sharp):
        """Symmetric and positive definite, as the kinetic energy's must be."""
        mass = motorcycle_matrices(sharp).E[2:6, 2:6]
        assert np.allclose(mass, mass.T)
        assert np.linalg.eigvalsh(mass).min() > 0

    def test_observable_with_torque(self, sharp):
        """Rank 9 with all five measurements, and with the gyroscope alone."""
        model = motorcycle_model(sharp).with_walking_inputs()
        assert model.states[-1] == "rider_torque"
        assert model.inputs == ("rider_torque_rate",)
        for rows in (range(5), [1, 2]):
            for s in np.linalg.eigvals(model.A(20.0)):
                pencil = np.vstack([model.A(20.0) - s * np.eye(9), model.C[list(rows)]])
                assert np.linalg.matrix_rank(pencil / np.abs(pencil).max(0)) == 9

    def test_lacking_parameter_is_named(self):
        with pytest.raises(cd.errors.VehicleError, match="front_frame_mass"):
            MotorcycleParameters.from_vehicle(cd.load_vehicle("bisoffi2017"))

    def test_every_parameter_matters(self, sharp):
        """Each parameter changes some root, so none is read and forgotten."""
        from dataclasses import replace

        base = np.sort_complex(np.linalg.eigvals(motorcycle_model(sharp).A(20.0)))
        for letter in LETTERS:
            other = replace(sharp, **{letter: 1.05 * getattr(sharp, letter)})
            roots = np.sort_complex(np.linalg.eigvals(motorcycle_model(other).A(20.0)))
            assert np.abs(roots - base).max() > 1e-6, letter


class TestPolytope:
    @pytest.mark.parametrize("which", ["motorcycle", "bicycle"])
    def test_exact(self, sharp, which):
        model = motorcycle_model(sharp) if which == "motorcycle" else bicycle_lpv(bicycle_matrices(BENCHMARK).to_iso())
        assert model.premises == ((1,) if which == "motorcycle" else (1, 2))
        polytope = model.polytope(8.0, 30.0)
        assert len(polytope.vertices) == (2 if which == "motorcycle" else 4)
        for v in np.linspace(8.0, 30.0, 23):
            weights = polytope.weights(v)
            assert weights.sum() == pytest.approx(1, abs=1e-14)
            assert weights.min() >= -1e-15
            assert np.abs(polytope.A(v) - model.A(v)).max() < 1e-12 * np.abs(model.A(v)).max()

    def test_outside_the_range(self, sharp):
        """The sum holds outside, the bounds do not."""
        model = motorcycle_model(sharp)
        polytope = model.polytope(8.0, 30.0)
        assert polytope.weights(35.0).min() < 0
        assert np.allclose(polytope.A(35.0), model.A(35.0))

    def test_negative_power(self):
        """A model with 1/rho, as tyres without relaxation make it."""
        model = LPV(
            {0: np.eye(1), -1: np.array([[-3.0]])},
            np.ones((1, 1)),
            np.eye(1),
            ("yaw_rate",),
            ("steer_angle",),
            ("yaw_rate",),
        )
        polytope = model.polytope(2.0, 10.0)
        assert polytope.A(4.0)[0, 0] == pytest.approx(1 - 3 / 4)
        assert 0 <= polytope.weights(4.0).min() <= 1
        with pytest.raises(ValueError, match="negative powers"):
            model.polytope(0.0, 10.0)

    def test_powers_that_do_not_occur(self, sharp):
        model = motorcycle_model(sharp)
        padded = LPV({**model.powers, 2: np.zeros((8, 8))}, model.B, model.C, model.states, model.inputs, model.outputs)
        assert len(padded.polytope(8.0, 30.0).vertices) == 2

    def test_wrong_shapes(self, sharp):
        model = motorcycle_model(sharp)
        with pytest.raises(ValueError, match="A_0 is"):
            LPV({0: np.eye(3)}, model.B, model.C, model.states, model.inputs, model.outputs)
        with pytest.raises(ValueError, match="upwards"):
            model.polytope(30.0, 8.0)


class TestVehicleFiles:
    @pytest.mark.parametrize(("name", "expected"), [("meijaard2007", BENCHMARK), ("pasma2024", STEER_BY_WIRE)])
    def test_bicycles(self, name, expected):
        found = BicycleParameters.from_vehicle(cd.load_vehicle(name))
        assert all(getattr(found, key) == pytest.approx(value, rel=1e-15) for key, value in vars(expected).items())

    def test_lpv_is_the_model(self):
        matrices = bicycle_matrices(BENCHMARK).to_iso()
        for v in (0.0, 3.0, 7.0):
            assert np.allclose(bicycle_lpv(matrices).A(v), bicycle_model(matrices, v).A, atol=1e-12)
            assert np.allclose(bicycle_lpv(matrices).B, bicycle_model(matrices, v).B)
