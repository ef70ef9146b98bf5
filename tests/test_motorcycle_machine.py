"""The nonlinear motorcycle against conserved quantities and against Sharp's linear model."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import codriver as cd
from codriver.models import MotorcycleParameters
from codriver.models.motorcycle import motorcycle_model
from codriver.simulate.motorcycle import FRONT_TYRE, INPUTS, STATES, Machine, MachineParameters, TyreParameters
from codriver.simulate.motorcycle.tyre import steady_forces

NOTHING = np.zeros(len(INPUTS))


def put(state: np.ndarray, **values: float) -> None:
    for name, value in values.items():
        state[STATES.index(name)] = value


@pytest.fixture(scope="module")
def sharp() -> MotorcycleParameters:
    return MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))


@pytest.fixture(scope="module")
def bare(sharp) -> Machine:
    """What Sharp's model has: no crown, no trail, no drag, tyres that do not give."""
    thin = TyreParameters(crown=0.0, pneumatic_trail=0.0, radial_stiffness=1e8)
    return Machine(MachineParameters(sharp, front=thin, rear=thin, drag_area=0.0))


class TestConserved:
    def test_flying_keeps_energy_and_angular_momentum(self, sharp):
        machine = Machine(MachineParameters(replace(sharp, K=0.0)), road=False, grip=False)
        state = machine.upright(20.0)
        put(state, roll=0.6, pitch=0.2, steer=0.3, y_rate=1.0, z_rate=0.5, yaw_rate=0.3)
        put(state, roll_rate=0.9, pitch_rate=-0.4, steer_rate=0.5)
        before = machine.conserved(state)
        first = state
        for _ in range(1000):
            state = machine.step(state, NOTHING)
        assert np.abs(state[6] - first[6]) > 1  # it does tumble
        np.testing.assert_allclose(machine.conserved(state), before, rtol=1e-9)

    def test_fall_of_the_mass_centre(self, sharp):
        machine = Machine(MachineParameters(replace(sharp, K=0.0)), road=False, grip=False)
        state = machine.upright(0.0)
        assert machine.rate(state, NOTHING)[STATES.index("z_rate")] == pytest.approx(-sharp.g, rel=1e-9)

    def test_ice_keeps_energy(self, sharp):
        stiff = replace(FRONT_TYRE, radial_damping=0.0)
        machine = Machine(
            MachineParameters(replace(sharp, K=0.0), front=stiff, rear=replace(stiff, crown=0.09)), grip=False
        )
        state = machine.upright(10.0)
        put(state, roll=0.1, z_rate=-0.3)  # leaning, and falling onto its springs
        before = machine.conserved(state)[0]
        rolls, travels = [], []
        for _ in range(800):
            state = machine.step(state, NOTHING, 5e-4)
            rolls.append(state[4])
            travels.append(state[2])
        assert max(rolls) - min(rolls) > 0.1
        assert np.ptp(travels) > 0.01
        assert machine.conserved(state)[0] == pytest.approx(before, rel=1e-6)


class TestLinear:
    def test_straight_ahead_is_an_equilibrium(self, bare):
        rate = bare.rate(bare.upright(20.0), NOTHING)
        rate[0] -= 20.0
        assert np.abs(rate).max() < 1e-6

    @pytest.mark.parametrize("speed", [6.0, 10.0, 20.0, 30.0, 40.0])
    def test_roots_are_sharps(self, bare, sharp, speed):
        roots = np.linalg.eigvals(bare.linearised(bare.upright(speed), NOTHING)[0])
        balanced = replace(sharp, load=bare.parameters.loads[0])  # 1007.0 N by masses and geometry, Sharp prints 1005.3
        for root in np.linalg.eigvals(motorcycle_model(balanced).A(speed)):
            assert np.abs(roots - root).min() < 2e-4 * abs(root) + 2e-4, root

    def test_a_crown_moves_the_weave(self, bare, sharp):
        wide = Machine(MachineParameters(sharp, drag_area=0.0))
        speed = 20.0
        weave = {}
        for name, machine in (("thin", bare), ("wide", wide)):
            roots = np.linalg.eigvals(machine.linearised(machine.upright(speed), NOTHING)[0])
            weave[name] = roots[np.abs(roots - (-4.55 + 16.2j)).argmin()]
        assert abs(weave["wide"] - weave["thin"]) > 0.1

    def test_the_rider_turns_the_bar_as_in_sharp(self, bare, sharp):
        state = bare.upright(20.0)
        B = bare.linearised(state, NOTHING)[1]
        rows = [STATES.index(name) for name in ("roll_rate", "steer_rate", "yaw_rate")]
        model = motorcycle_model(sharp)
        np.testing.assert_allclose(B[rows, 0], model.B[[4, 5, 3], 0], rtol=0.01)


class TestTyre:
    def forces(self, load, slip, camber=0.0, along=0.0):
        tyre = replace(FRONT_TYRE, friction=1.2)
        args = [ca.SX(value) for value in (load, slip, camber, 0.0, along)]
        return [float(value) for value in steady_forces(*args, 1000.0, (11000.0, 950.0), tyre)]

    def test_slopes_at_the_static_load(self):
        small = 1e-5
        assert self.forces(1000.0, small)[1] / small == pytest.approx(-11000, rel=1e-3)
        assert self.forces(1000.0, 0.0, small)[1] / small == pytest.approx(-950, rel=1e-3)

    def test_saturates_at_friction(self):
        sides = [-self.forces(1000.0, slip)[1] for slip in np.linspace(0, 1.0, 400)]
        assert max(sides) == pytest.approx(1200, rel=1e-3)
        assert sides[-1] < max(sides)

    def test_load_is_degressive_and_friction_is_shared(self):
        small = 1e-4
        assert 1.0 < self.forces(2000.0, small)[1] / self.forces(1000.0, small)[1] < 1.8
        assert self.forces(1000.0, small, along=720.0)[1] == pytest.approx(
            0.8 * self.forces(1000.0, small)[1], rel=1e-9
        )
