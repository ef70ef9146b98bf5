"""Observers of unknown inputs for any linear plant: theorem 1, the Kalman filter, the unknown-input observer; against others."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import codriver as cd
from codriver.errors import DesignError
from codriver.models import StateSpace, steering_model
from codriver.observers.disturbance import disturbance_observer
from codriver.observers.disturbance_design import design_disturbance_filter
from codriver.observers.observer import Observer
from codriver.observers.pi import pi_observer
from codriver.observers.pi_design import design_pi_observer
from codriver.observers.pi_weights import PI_WEIGHTS, wheel_pi_design
from codriver.observers.uio import unknown_input_observer
from codriver.observers.uio_design import design_unknown_input_observer
from codriver.observers.unknown_input import undetectable, with_unknown
from codriver.testing import check_observer

J, B = 0.0672, 0.3562
DT = 0.01
PAPER = PI_WEIGHTS["okamoto2019"]
T = np.arange(601) * DT
ALIGNMENT, DRIVER = np.sin(4 * T - pi / 5), 3 * np.sin(3 * T)  # eq. (87), (88)


def wheel(rate_too: bool = False) -> StateSpace:
    plant = steering_model(J, B)
    if not rate_too:
        return plant
    names = ("steering_wheel_angle", "steering_wheel_rate")
    return StateSpace(plant.A, plant.B, np.eye(2), np.zeros((2, 2)), plant.states, plant.inputs, names)


def two_masses() -> StateSpace:
    """Two masses, spring and damper between them; a force on each, the second's unknown; both places measured."""
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-4, 4, -0.4, 0.4], [2, -2, 0.2, -0.2]], float)
    Bm = np.array([[0, 0], [0, 0], [1, 0], [0, 0.5]], float)
    return StateSpace(
        A, Bm, np.eye(2, 4), np.zeros((2, 2)), ("distance", "altitude", "longitudinal_speed", "lateral_velocity"),
        ("known_input", "driver_torque"), ("distance", "altitude"),
    )  # fmt: skip


def moved(plant: StateSpace, inputs: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outputs and states by scipy, inputs straight between ticks."""
    from scipy.signal import lsim

    _, y, x = lsim((plant.A, plant.B, plant.C, plant.D), inputs, T, start)
    return y.reshape(T.size, -1), x


def run(observer: Observer, signals: dict[str, np.ndarray], missing: np.ndarray | None = None) -> dict[str, np.ndarray]:
    there = np.ones(T.size, bool)
    fresh = there if missing is None else ~missing
    rows = {n: fresh if n in observer.measured else there for n in observer.channels}
    return cd.compile(observer).run_grid(cd.Grid(T, observer.dt, signals, rows, rows))


class TestTheorem1:
    def test_gain_is_that_of_another_library(self):
        """python-control's lqe on (40), and the identities of the theorem."""
        import control

        d = wheel_pi_design(J, B, PAPER)
        A = np.block([[d.T_1 @ d.model.A, d.T_1 @ d.B_v], [np.zeros((1, 3))]])
        C = np.hstack([d.C, [[0.0]]])
        gain, _, eigenvalues = control.lqe(A, np.eye(3), C, np.diag(PAPER.V_1), [[PAPER.V_2]])
        np.testing.assert_allclose(np.vstack([d.L_2, d.L_3]), gain, rtol=1e-6)
        np.testing.assert_allclose(
            np.sort_complex(d.certificate.eigenvalues), np.sort_complex(np.asarray(eigenvalues)), rtol=1e-6
        )
        assert d.certificate.holds
        np.testing.assert_allclose(d.T_1 + d.T_2 @ d.C, np.eye(2), atol=1e-12)
        np.testing.assert_allclose(d.F, d.T_1 @ d.model.A - d.L_2 @ d.C, atol=1e-9)
        np.testing.assert_allclose(d.L_1, d.F @ d.T_2, atol=1e-9)

    def test_pseudo_inverse_in_closed_form(self):
        """(35) for C = c [1 0] is T_1 = diag(1 / (1 + c^2), 1), T_2 = [c / (1 + c^2); 0]."""
        d, c = wheel_pi_design(J, B, PAPER), 180 / pi
        np.testing.assert_allclose(d.T_1, np.diag([1 / (1 + c * c), 1]), atol=1e-12)
        np.testing.assert_allclose(d.T_2, [[c / (1 + c * c)], [0]], atol=1e-12)

    @pytest.mark.parametrize("own", [None, np.zeros((2, 1)), np.array([[0.5], [1.0]])])
    def test_any_T_2_estimates_a_constant(self, own):
        d = design_pi_observer(wheel(), ("driver_torque",), [1, 1, 1e5], 1e-4, own)
        y, _ = moved(wheel(), np.column_stack([ALIGNMENT, np.full(T.size, 1.7)]), np.array([0.3, 0.0]))
        out = run(pi_observer(d, DT), {"steering_wheel_angle": y[:, 0], "alignment_torque": ALIGNMENT})
        late = 10 / d.certificate.decay_rate < T
        assert late.sum() > 100
        np.testing.assert_allclose(out["driver_torque"][late], 1.7, atol=2e-3)

    @pytest.mark.parametrize("inputs", ["straight", "held"])
    def test_step_is_the_continuous_observer(self, inputs):
        """Against scipy's lsim of (33), with its inputs straight or held between ticks."""
        from scipy.signal import lsim

        d = design_pi_observer(two_masses(), ("driver_torque",), [1, 1, 1, 1, 1e4], [1e-2, 1e-2])
        system, rng = d.system, np.random.default_rng(1)
        w = np.column_stack([np.sin(3 * T), np.cos(2 * T), rng.standard_normal(T.size)])
        start = np.r_[d.T_1 @ [w[0, 0], w[0, 1], 0, 0], 0]
        _, wanted, _ = lsim(
            (system.A, system.B, system.C, system.D), w, T, start, interp=inputs == "straight"
        )  # fmt: skip
        signals = {"distance": w[:, 0], "altitude": w[:, 1], "known_input": w[:, 2]}
        out = run(pi_observer(d, DT, inputs=inputs), signals)
        for k, name in enumerate(system.outputs):
            np.testing.assert_allclose(out[name], wanted[:, k], atol=1e-8 * np.abs(wanted).max())

    def test_without_measurements_it_runs_on_as_the_model(self):
        """From the tick on which the last angle came, the estimate is the plant's free motion under what it then knows."""
        d = wheel_pi_design(J, B, PAPER)
        y, _ = moved(wheel(), np.column_stack([ALIGNMENT, DRIVER]), np.array([1.0, 0.0]))
        missing = (T > 3.0) & (T < 3.4)
        o = pi_observer(d, DT, scales=[180 / pi])
        out = run(o, {"steering_wheel_angle": y[:, 0], "alignment_torque": ALIGNMENT}, missing)
        first = int(np.flatnonzero(missing)[0]) - 1
        held = slice(first, int(np.flatnonzero(missing)[-1]) + 1)
        torque = out["driver_torque"][first]
        free, _ = (a[: held.stop - held.start] for a in (T, T))
        from scipy.signal import lsim

        plant = wheel()
        _, _, x = lsim(
            (plant.A, plant.B, plant.C, plant.D),
            np.column_stack([ALIGNMENT[held], np.full(free.size, torque)]), free,
            [out["steering_wheel_angle"][first], out["steering_wheel_rate"][first]],
        )  # fmt: skip
        np.testing.assert_allclose(out["driver_torque"][held], torque, atol=1e-6)
        np.testing.assert_allclose(out["steering_wheel_angle"][held], x[:, 0], atol=1e-6)
        np.testing.assert_allclose(out["steering_wheel_rate"][held], x[:, 1], atol=1e-5)

    def test_checklist(self):
        check_observer(pi_observer(wheel_pi_design(J, B, PAPER), DT, scales=[180 / pi]))
        check_observer(pi_observer(design_pi_observer(two_masses(), ("driver_torque",), np.eye(5), np.eye(2)), 0.02))


class TestRefusals:
    def test_a_torque_without_weight(self):
        """V_1 = diag(1, 1, 0) leaves an eigenvalue at 0: the theorem needs (A~, V_1^(1/2)) stabilisable, too."""
        with pytest.raises(DesignError, match="stabilisable"):
            design_pi_observer(wheel(), ("driver_torque",), [1, 1, 0], 1.0)

    def test_two_unknown_torques_behind_one_angle(self):
        with pytest.raises(DesignError, match="not detectable"):
            design_pi_observer(wheel(), ("driver_torque", "alignment_torque"), np.eye(4), 1.0)

    def test_an_unstable_mode_that_nothing_sees(self):
        A = np.array([[0, 1, 0], [0, -1, 0], [0, 0, 0.3]])
        plant = StateSpace(
            A, [[0], [1], [0]], [[1, 0, 0]], [[0]], ("distance", "longitudinal_speed", "altitude"), ("driver_torque",),
            ("distance",),
        )  # fmt: skip
        assert undetectable(plant.A, plant.C).real.max() == pytest.approx(0.3)
        for design in (
            lambda: design_pi_observer(plant, ("driver_torque",), np.eye(4), 1.0),
            lambda: design_disturbance_filter(plant, ("driver_torque",), DT, unknown_noise=[1], output_noise=[1]),
        ):
            with pytest.raises(DesignError, match="not detectable"):
                design()

    @pytest.mark.parametrize(
        ("V_1", "V_2"),
        [([1, 1], 1.0), ([1, -1, 1], 1.0), ([1, 1, 1], 0.0), (np.ones((3, 2)), 1.0), ([1, 1, np.nan], 1.0)],
    )
    def test_weights_that_cannot_be(self, V_1, V_2):
        with pytest.raises(DesignError):
            design_pi_observer(wheel(), ("driver_torque",), V_1, V_2)

    def test_inputs_of_no_plant(self):
        with pytest.raises(DesignError, match="some of"):
            with_unknown(wheel(), ("rider_torque",))
        with pytest.raises(DesignError):
            with_unknown(wheel(), ("driver_torque",), 3)

    def test_unknown_input_observer_where_only_the_angle_is_measured(self):
        """Remark 3: C B_v = 0."""
        with pytest.raises(DesignError, match=r"rank\(C D\) = 0, rank\(D\) = 1"):
            design_unknown_input_observer(wheel(), ("driver_torque",), [1, 1], [1], 0.05)

    def test_numbers_that_cannot_be(self):
        for Q, R in (([1, 1], [0, 0]), ([1, -1], [1, 1]), ([1], [1, 1]), ([1, np.nan], [1, 1])):
            with pytest.raises(DesignError, match="correct them"):
                design_unknown_input_observer(wheel(True), ("driver_torque",), Q, R, 0.05)
        plant = wheel()
        broken = StateSpace(plant.A * np.nan, plant.B, plant.C, plant.D, plant.states, plant.inputs, plant.outputs)
        with pytest.raises(DesignError, match="not finite"):
            design_pi_observer(broken, ("driver_torque",), np.eye(3), 1.0)


class TestUnknownInputObserver:
    def test_tells_the_input_behind_its_low_pass(self):
        """v^ = v / (1 + tau s) exactly, whatever v: against scipy."""
        from scipy.signal import lsim

        d = design_unknown_input_observer(wheel(True), ("driver_torque",), [1, 1], [1e-2, 1e-2], 0.05)
        assert d.certificate.holds
        y, x = moved(wheel(True), np.column_stack([ALIGNMENT, DRIVER]), np.array([0.4, -0.2]))
        signals = dict(zip(("steering_wheel_angle", "steering_wheel_rate"), y.T, strict=True))
        out = run(unknown_input_observer(d, DT), {**signals, "alignment_torque": ALIGNMENT})
        _, wanted, _ = lsim(([[-20.0]], [[20.0]], [[1.0]], [[0.0]]), DRIVER, T)
        late = out["valid"] > 0.5
        assert late.mean() > 0.8
        # What is left is the plant's curve between ticks, which the observer takes for straight.
        assert np.abs(out["driver_torque"] - wanted)[late].max() < 5e-3
        assert np.abs(out["steering_wheel_rate"] - x[:, 1])[late].max() < 1e-3

    def test_checklist(self):
        design = design_unknown_input_observer(wheel(True), ("driver_torque",), [1, 1], [1, 1], 0.05)
        check_observer(unknown_input_observer(design, DT))


class TestKalman:
    @pytest.mark.parametrize("order", [1, 2])
    def test_against_filterpy(self, order):
        """filterpy's filter on the same matrices, a quarter of the angles missing; means and deviations."""
        from filterpy.kalman import KalmanFilter

        rng = np.random.default_rng(2)
        y, _ = moved(wheel(), np.column_stack([ALIGNMENT, DRIVER]), np.array([0.1, 0.0]))
        y = y[:, 0] + 1e-3 * rng.standard_normal(T.size)
        missing = rng.random(T.size) < 0.25
        d = design_disturbance_filter(
            wheel(),
            ("driver_torque",),
            DT,
            unknown_noise=[30.0],
            output_noise=[1e-6],
            state_noise=[0, 0.01],
            order=order,
        )
        sd = [1.0, 5.0, 20.0, 100.0][: 2 + order]
        out = run(disturbance_observer(d, sd), {"steering_wheel_angle": y, "alignment_torque": ALIGNMENT}, missing)
        other = KalmanFilter(2 + order, 1, 2)
        other.F, other.H, other.Q, other.R = d.F, d.model.C, d.Q_d, np.array([[1e-6]])
        other.B = np.hstack([d.G_0, d.G_1])
        other.P = np.diag(np.square(sd))
        for k in range(T.size):
            other.predict(np.array([[ALIGNMENT[k - 1] if k else 0.0], [ALIGNMENT[k]]]))
            if not missing[k]:
                other.update(y[k])
            assert out["driver_torque"][k] == pytest.approx(float(other.x[2, 0]), rel=1e-6, abs=1e-6)
            assert out["driver_torque_sd"][k] == pytest.approx(float(np.sqrt(other.P[2, 2])), rel=1e-6)

    def test_remark_3_does_not_hold(self):
        """One measurement and one unknown input: the filter needs a detectable pair, not more measurements than inputs."""
        d = design_disturbance_filter(
            wheel(), ("driver_torque",), DT, unknown_noise=[1e4], output_noise=[1e-10], order=2
        )
        y, _ = moved(wheel(), np.column_stack([ALIGNMENT, DRIVER]), np.array([0.1, 0.0]))
        observer = disturbance_observer(d, [1, 5, 20, 100])
        out = run(observer, {"steering_wheel_angle": y[:, 0], "alignment_torque": ALIGNMENT})
        assert np.abs(out["driver_torque"] - DRIVER)[T > 1].max() < 0.05

    def test_stationary_gain_is_that_of_the_running_filter(self):
        d = design_disturbance_filter(wheel(), ("driver_torque",), DT, unknown_noise=[30.0], output_noise=[1e-6])
        out = run(
            disturbance_observer(d, [1, 5, 20]),
            {"steering_wheel_angle": np.zeros(T.size), "alignment_torque": ALIGNMENT},
        )
        assert out["driver_torque_sd"][-1] == pytest.approx(float(np.sqrt(d.P[2, 2])), rel=1e-9)

    def test_checklist(self):
        d = design_disturbance_filter(
            two_masses(), ("driver_torque",), 0.02, unknown_noise=[3.0], output_noise=[1, 2], order=2
        )
        check_observer(disturbance_observer(d, np.ones(6)))

    def test_noises_that_cannot_be(self):
        for noise in ({"unknown_noise": [0.0]}, {"output_noise": [-1.0]}, {"state_noise": [1.0]}):
            with pytest.raises(DesignError, match="correct the noises"):
                design_disturbance_filter(
                    wheel(), ("driver_torque",), DT, **{"unknown_noise": [1], "output_noise": [1], **noise}
                )
