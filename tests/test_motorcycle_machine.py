"""The nonlinear motorcycle against conserved quantities and against Sharp's linear model."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import codriver as cd
from codriver.models import MotorcycleParameters
from codriver.models.motorcycle import motorcycle_model
from codriver.simulate.motorcycle import (
    FRONT_TYRE,
    INPUTS,
    STATES,
    Machine,
    MachineParameters,
    Suspension,
    TyreParameters,
    UpperBody,
)
from codriver.simulate.motorcycle.masses import solid, without
from codriver.simulate.motorcycle.rider_law import lateral_model
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
    """What Sharp's model has: no crown, no trail, no drag."""
    thin = TyreParameters(crown=0.0, pneumatic_trail=0.0)
    return Machine(MachineParameters(sharp, front=thin, rear=thin, drag_area=0.0))


SOFT = {"suspension": Suspension(front_damping=0.0, rear_damping=0.0), "upper_body": UpperBody(damping=0.0)}


class TestConserved:
    def test_flying_keeps_energy_and_angular_momentum(self, sharp):
        machine = Machine(MachineParameters(replace(sharp, K=0.0), **SOFT), road=False, grip=False)
        state = machine.upright(20.0)
        put(state, roll=0.6, pitch=0.2, steer=0.3, y_rate=1.0, z_rate=0.5, yaw_rate=0.3, rider_lean=0.2)
        put(state, roll_rate=0.9, pitch_rate=-0.4, steer_rate=0.5, front_travel=0.03, rider_lean_rate=1.0)
        before = machine.conserved(state)
        rows = []
        for _ in range(600):
            state = machine.step(state, NOTHING)
            rows.append(state)
        for name in ("steer", "roll", "yaw", "rider_lean"):
            assert np.ptp(np.array(rows)[:, STATES.index(name)]) > 0.1, name  # it does tumble
        np.testing.assert_allclose(machine.conserved(state), before, rtol=1e-8)

    def test_ice_keeps_energy(self, sharp):
        undamped = replace(FRONT_TYRE, radial_damping=0.0)
        machine = Machine(
            MachineParameters(replace(sharp, K=0.0), front=undamped, rear=replace(undamped, crown=0.09), **SOFT),
            grip=False,
        )
        state = machine.upright(10.0)
        put(state, roll=0.1, z_rate=-0.3)  # leaning, and falling onto its springs
        before = machine.conserved(state)[0]
        rows = []
        for _ in range(600):
            state = machine.step(state, NOTHING, 5e-4)
            rows.append(state)
        for name, moved in (("roll", 0.05), ("z", 0.01), ("front_travel", 0.01), ("rider_lean", 0.02)):
            assert np.ptp(np.array(rows)[:, STATES.index(name)]) > moved
        assert machine.conserved(state)[0] == pytest.approx(before, rel=1e-6)

    def test_parts_taken_out_leave_the_rest(self):
        """Four balls on a rod, of which the middle two are taken out."""
        balls = [solid(1.0, (x, 0.0, 0.0), (0.0, 0.0, 0.0)) for x in (-2.0, -1.0, 1.0, 2.0)]
        whole = solid(4.0, (0, 0, 0), sum(ball.about(np.zeros(3)) for ball in balls) + 1e-9 * np.eye(3))
        np.testing.assert_allclose(np.diag(whole.inertia), [0, 10, 10], atol=1e-8)
        left = without(whole, balls[:2])
        assert left.centre[0] == pytest.approx(1.5)
        np.testing.assert_allclose(np.diag(left.inertia), [0, 0.5, 0.5], atol=1e-8)
        with pytest.raises(ValueError, match="leave"):
            without(whole, [solid(5.0, (0, 0, 0), (0, 0, 0))])


class TestLinear:
    def test_straight_ahead_is_an_equilibrium(self, bare):
        rate = bare.rate(bare.upright(20.0), NOTHING)
        rate[0] -= 20.0
        assert np.abs(rate).max() < 1e-6

    @pytest.mark.parametrize("soft", [False, True])
    @pytest.mark.parametrize("speed", [6.0, 10.0, 20.0, 30.0, 40.0])
    def test_roots_are_sharps(self, bare, sharp, speed, soft):
        """To rounding, on soft tyres and springs too: a wheel that gives way in its own plane rolls as a rigid one."""
        machine = Machine(replace(bare.parameters, suspension=Suspension())) if soft else bare
        roots = np.linalg.eigvals(machine.linearised(machine.upright(speed), NOTHING)[0])
        balanced = replace(sharp, load=bare.parameters.loads[0])  # 1007.0 N by masses and geometry, Sharp prints 1005.3
        for root in np.linalg.eigvals(motorcycle_model(balanced).A(speed)):
            assert np.abs(roots - root).min() < 1e-8 * abs(root) + 1e-8, root

    def test_stiff_hips_are_a_rigid_rider(self, bare, sharp):
        machine = Machine(replace(bare.parameters, upper_body=UpperBody(stiffness=1e8, damping=1e5)))
        rigid = motorcycle_model(replace(sharp, load=bare.parameters.loads[0]))
        roots = np.linalg.eigvals(machine.linearised(machine.upright(20.0), NOTHING)[0])
        for root in np.linalg.eigvals(rigid.A(20.0)):
            assert np.abs(roots - root).min() < 1e-3 * abs(root)

    def test_the_riders_model_is_sharps(self, bare, sharp):
        A, B = lateral_model(bare, 20.0)
        rigid = motorcycle_model(replace(sharp, load=bare.parameters.loads[0]))
        np.testing.assert_allclose(A, rigid.A(20.0), atol=1e-6)
        np.testing.assert_allclose(B, rigid.B, atol=1e-9)

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
