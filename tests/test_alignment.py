"""Single track and alignment map: against closed forms, other libraries and brute force."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

import codriver as cd
from codriver.models.alignment import ROAD_SLOWEST, USUAL, AlignmentModel
from codriver.models.single_track import SingleTrack

CAR = SingleTrack(1850.0, 3300.0, 1.33, 1.52, 1.0e5, 1.3e5)
TAIL = replace(CAR, front=1.7, rear=1.15)
MAP = AlignmentModel(1.4, 1.2, -0.12, 0.03, 0.3, 14.8, 2.85, 28.0, 0.5, 0.18, 0.002)


def along(model: AlignmentModel, angle: np.ndarray, speed: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """T_aln and the states, tick by tick."""
    states, torque, path = dict(model.states), [], []
    for a, v in zip(angle, speed, strict=True):
        states = model.advance(states, float(a), float(v), dt)
        torque.append(model.torque(states, float(a), float(v)))
        path.append(list(states.values()))
    return np.array(torque), np.array(path)


class TestSingleTrack:
    def test_steady_turn_against_control(self):
        """python-control's steady gain, and the closed form."""
        import control

        for v in (5.0, 15.0, 40.0):
            model = CAR.model(v)
            gain = control.dcgain(control.ss(model.A, model.B, model.C, model.D)).ravel()
            assert gain[1] == pytest.approx(v / (CAR.wheelbase + CAR.understeer_gradient * v**2), rel=1e-12)
            # Lateral acceleration of the front axle: its force over the mass that it carries.
            force = CAR.front_stiffness * CAR.front_slip(gain[0], gain[1], 1.0, v)
            assert force / CAR.front_mass == pytest.approx(v * gain[1], rel=1e-12)

    def test_characteristic_speed(self):
        v = CAR.characteristic_speed
        A, B = CAR.model(v).A, CAR.model(v).B
        assert np.linalg.solve(-A, B)[1, 0] == pytest.approx(v / CAR.wheelbase / 2, rel=1e-12)
        assert CAR.critical_speed == inf
        assert TAIL.characteristic_speed == inf

    def test_critical_speed(self):
        v = TAIL.critical_speed
        assert (
            np.linalg.eigvals(TAIL.model(0.99 * v).A).real.max()
            < 0
            < np.linalg.eigvals(TAIL.model(1.01 * v).A).real.max()
        )

    def test_advance_against_scipy(self):
        from scipy.signal import lsim

        model, t = CAR.model(20.0), np.arange(0, 2, 1e-3)
        steer = 0.02 * np.sin(3 * t)
        exact = lsim((model.A, model.B, model.C, model.D), steer, t)[1]
        x, found = (0.0, 0.0), []
        for d in steer:
            x = CAR.advance(*x, float(d), 20.0, 1e-3)
            found.append(x)
        assert np.abs(np.array(found) - exact).max() < 0.005 * np.abs(exact).max()

    def test_refusals(self):
        with pytest.raises(ValueError, match="front_stiffness is -1"):
            replace(CAR, front_stiffness=-1.0)
        with pytest.raises(ValueError, match="moves forward"):
            CAR.model(0.0)

    def test_names(self):
        model = CAR.model(20.0)
        assert all(name in cd.names.VOCABULARY for name in (*model.states, *model.inputs))


class TestAlignmentModel:
    def test_turns_the_wheel_back(self):
        """A turn to the left pulls to the right; the map is odd about its offset and bends."""
        states = MAP.advance(MAP.states, 0.3, 20.0, 0.02)
        left = MAP.torque(states, 0.3, 20.0)
        right = MAP.torque(MAP.advance(MAP.states, -0.3, 20.0, 0.02), -0.3, 20.0)
        assert left < MAP.felt(0.0) < right
        assert left + right == pytest.approx(-2 * MAP.offset, abs=1e-12)
        lateral = np.array([0.01, 1.0, 4.0])
        slope = -(MAP.felt(lateral) - MAP.felt(0.0)) / lateral
        assert slope[0] == pytest.approx(MAP.gain, rel=0.01)
        assert slope[0] > slope[1] > slope[2] > 0

    def test_no_torque_on_a_road_banked_for_the_speed(self):
        """With q = 1 and far below e_max the bank takes all of the steady turn's acceleration, at v_r."""
        road = replace(MAP, bank=0.3, bank_share=1.0)
        angle, speed = np.full(500, 0.02), np.full(500, 20.0)
        torque, _ = along(road, angle, speed, 0.05)
        level, _ = along(replace(road, bank=0.0), angle, speed, 0.05)
        assert abs(torque[-1] + road.offset) < 0.02 * abs(level[-1] + road.offset)

    def test_slow_on_a_banked_curve_is_pulled_inwards(self):
        """The driver of a queue in a motorway's bend to the left holds to the right."""
        dt = 0.1
        speed = np.r_[np.full(600, 28.0), np.full(200, 4.0)]
        torque, _ = along(replace(MAP, offset=0.0), np.full(800, 0.06), speed, dt)
        assert torque[500] < 0 < torque[-1]

    def test_states_against_brute_force(self):
        """Road's curvature and speed against fine integration of their differential equations."""
        from scipy.integrate import solve_ivp

        t = np.arange(0, 60, 0.02)
        angle, speed = 0.1 * np.sin(0.5 * t), 16 + 8 * np.sin(0.2 * t)
        _, path = along(MAP, angle, speed, 0.02)

        def right(time, x):
            v = np.interp(time, t, speed)
            pace = max(v, ROAD_SLOWEST)
            kappa = MAP.curvature(np.interp(time, t, angle), v)
            return [v / 20 * (kappa - x[0]), v / (100 if pace > x[1] else 3000) * (pace - x[1])]

        exact = solve_ivp(right, (0, t[-1]), [0.0, 16.0], t_eval=t, max_step=0.05, rtol=1e-6).y
        assert np.abs(path[:, 3] - exact[0]).max() < 0.01 * np.abs(exact[0]).max()
        assert np.abs(path[:, 4] - exact[1]).max() < 0.05

    def test_friction_against_dahl(self):
        """Presliding against Dahl's closed form for one direction, 1 + (z0 - 1) exp(-d / w); its bound holds whatever comes."""
        z = -1.0
        for _ in range(400):
            z = MAP.slide(z, 1e-5)
        assert z == pytest.approx(1 - 2 * np.exp(-400e-5 / MAP.width), abs=0.01)
        rng = np.random.default_rng(1)
        for step in rng.standard_normal(1000) * rng.choice([1e-4, 1e-2, 1.0], 1000):
            z = MAP.slide(z, step)
            assert abs(z) <= 1
        assert MAP.friction({"presliding": 1.0}, 2.0) == pytest.approx(MAP.coulomb + 2 * MAP.damping)

    @pytest.mark.parametrize("track", [None, CAR], ids=["steady", "single track"])
    def test_symbols_say_the_same(self, track):
        import casadi as ca

        model = replace(MAP, track=track)
        names = list(model.states)
        carried, a, v = ca.SX.sym("x", len(names)), ca.SX.sym("a"), ca.SX.sym("v")
        new = model.advance(dict(zip(names, ca.vertsplit(carried), strict=True)), a, v, 0.02)
        told = [*new.values(), model.torque(new, a, v), model.friction(new, 0.3)]
        step = ca.Function("step", [carried, a, v], [ca.vertcat(*told)])
        rng, states, x = np.random.default_rng(0), dict(model.states), np.zeros(len(names))
        for _ in range(50):
            angle, speed = float(rng.normal(0, 0.3)), float(rng.uniform(0, 30))
            states = model.advance(states, angle, speed, 0.02)
            whole = np.array(step(x, angle, speed)).ravel()
            x = whole[: len(names)]
            plain = [*states.values(), model.torque(states, angle, speed), model.friction(states, 0.3)]
            assert np.isfinite(whole).all()
            assert whole == pytest.approx(plain, rel=1e-12, abs=1e-13)

    def test_compiled_says_the_same_bits(self):
        """The map inside an observer's step: machine code against plain floats."""
        from codriver.observers import Observer, Output

        def step(carry, u, y, ok, rho):
            new = MAP.advance(carry, u["steering_wheel_angle"], u["longitudinal_speed"], 0.02)
            torque = MAP.torque(new, u["steering_wheel_angle"], u["longitudinal_speed"])
            return new, {"alignment_torque": torque, "driver_torque": MAP.friction(new, 0.3) - torque, "valid": 1.0}

        names = ("steering_wheel_angle", "longitudinal_speed")
        observer = Observer(
            "map", 0.02, names, (), MAP.states,
            (Output("alignment_torque", "N*m", "estimate"), Output("driver_torque", "N*m", "estimate")), step,
        )  # fmt: skip
        t = np.arange(2000) * 0.02
        columns = {names[0]: 0.3 * np.sin(0.7 * t) + 0.05 * np.sin(9 * t), names[1]: 15 + 14 * np.sin(0.1 * t)}
        there = np.ones(t.size, bool)
        out = cd.compile(observer).run_grid(
            cd.Grid(t, 0.02, columns, dict.fromkeys(names, there), dict.fromkeys(names, there))
        )
        plain, path = along(MAP, columns[names[0]], columns[names[1]], 0.02)
        assert np.array_equal(out["alignment_torque"], plain)
        rubbing = np.array([MAP.friction({"presliding": z}, 0.3) for z in path[:, 2]])
        assert np.array_equal(out["driver_torque"], rubbing - plain)

    def test_arrays(self):
        angle, speed = np.linspace(-0.5, 0.5, 7), np.full(7, 18.0)
        states = {"road_curvature": MAP.curvature(angle, speed), "road_speed": speed}
        each = [MAP.torque({"road_curvature": MAP.curvature(a, 18.0), "road_speed": 18.0}, a, 18.0) for a in angle]
        assert MAP.torque(states, angle, speed) == pytest.approx(each, rel=1e-14)

    def test_of_a_vehicle(self):
        empty = cd.Vehicle("car", "a car", "none", {})
        with pytest.raises(cd.errors.VehicleError, match="alignment_gain"):
            AlignmentModel.from_vehicle(empty)
        model = AlignmentModel.from_vehicle(
            empty.with_parameter("alignment_gain", 1.3).with_parameter("steering_ratio", 14.8)
        )
        assert (model.gain, model.steering_ratio, model.bank) == (1.3, 14.8, USUAL["road_bank"])
        with pytest.raises(ValueError, match="width is 0"):
            replace(MAP, width=0.0)

    def test_equation_92(self):
        """As printed, with K_aln of the other sign; a steady turn turns the wheel back."""
        values = {"mass": 1850, "yaw_inertia": 3300, "front_axle_distance": 1.33, "wheelbase": 2.85, "steering_ratio": 14.8,
                  "front_cornering_stiffness": 1e5, "rear_cornering_stiffness": 1.3e5, "alignment_stiffness": 1200.0}  # fmt: skip
        vehicle = cd.Vehicle("car", "a car", "none", {})
        for name, value in values.items():
            vehicle = vehicle.with_parameter(name, value)
        model = AlignmentModel.eq_92(vehicle)
        t = np.arange(0, 5, 0.01)
        angle = 0.3 * np.tanh(t)
        torque, path = along(model, angle, np.full(t.size, 20.0), 0.01)
        beta, r = path[:, 5], path[:, 6]
        assert torque == pytest.approx(1200 / 14.8 * (beta + 1.33 * r / 20 - angle / 14.8), rel=1e-12)
        steady = 1200 / 14.8 * CAR.front_mass / CAR.front_stiffness * 20.0**2 * model_curvature(20.0, 0.3)
        assert torque[-1] == pytest.approx(-steady, rel=1e-3)


def model_curvature(speed: float, angle: float) -> float:
    """1/m, by Ackermann and the understeer gradient."""
    return angle / 14.8 / (CAR.wheelbase + CAR.understeer_gradient * speed**2)
