"""How a rider leans the machine with the handlebar: Riccati's gain for riding straight ahead, on what he feels, as late as he does.

    tau = tau_ref - k(v) (x^ - x_ref),   A x_ref + B tau_ref = 0 at the wanted roll
    Y = S x,   S = -A_YY^-1 A_Yx                          a rider who does not feel the tyres takes their forces for settled
    x^(t) = exp(A_r T) x(t - T) + integral exp(A_r s) B_r tau(t - s) ds      he foretells what he feels T late, from his own torques

x: roll, steer, lateral velocity of the road point, yaw rate, roll rate, steer rate, tyre forces. A, B: the machine's own linear
model, hips held; A_r, B_r: with settled forces. He does not know what large angles do. A human with delay and prediction: Kleinman,
Baron, Levison 1970 (Automatica 6, 357), doi:10.1016/0005-1098(70)90051-8.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm, solve_continuous_are

from codriver.signals.signal import Array
from codriver.simulate.motorcycle.machine import INPUTS, STATES, Machine

# What a state's unit is worth to the rider: roll, steer, lateral velocity, yaw rate, roll rate, steer rate, both forces.
WORTH = np.array([4e4, 4e3, 0.0, 0.0, 1e3, 1e2, 0.0, 0.0])
FELT = 6  # states that are no forces


@dataclass(frozen=True, eq=False)
class Law:
    """Torque at one speed: of the wanted roll, less that of what was felt T ago and of the torques since.

    Attributes:
        gain: of x(t - T), N m a unit, shape (8,).
        past: of the torques since, the oldest first.
        wanted: N m/rad.
    """

    gain: Array
    past: Array
    wanted: float


@dataclass
class Hands:
    """The rider's law at all speeds, and his memory.

    Attributes:
        machine: that he knows.
        feels_forces: whether he feels the tyres' forces.
        delay: T, s.
        dt: of a tick, s.
    """

    machine: Machine
    feels_forces: bool
    delay: float
    dt: float
    _laws: dict[int, Law] = field(default_factory=dict, init=False, repr=False)
    _states: Array = field(init=False, repr=False)
    _torques: Array = field(init=False, repr=False)
    _known: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        late = round(self.delay / self.dt)
        self._states, self._torques = np.zeros((late + 1, 8)), np.zeros(late)

    def torque(self, speed: float, state: Array, wanted: float, strongest: float) -> float:
        """Torque of this tick, N m.

        Args:
            speed: m/s.
            state: x now.
            wanted: roll, rad.
            strongest: greatest torque, N m.
        """
        late = len(self._torques)
        if self._known == 0:
            self._states[:] = state
        place = self._known % (late + 1)
        self._states[place] = state
        felt = self._states[(self._known + 1) % (late + 1)]
        law = self._law(speed)
        torque = law.wanted * wanted - float(law.gain @ felt)
        if late:
            now = self._known % late
            torque -= float(law.past[: late - now] @ self._torques[now:]) + float(
                law.past[late - now :] @ self._torques[:now]
            )
        torque = min(max(torque, -strongest), strongest)
        if late:
            self._torques[self._known % late] = torque
        self._known += 1
        return torque

    def _law(self, speed: float) -> Law:
        """At the nearest whole m/s."""
        key = round(speed)
        if key not in self._laws:
            A, B = lateral_model(self.machine, float(key))
            riccati = solve_continuous_are(A, B, np.diag(WORTH) + 1e-9 * np.eye(8), np.eye(1))
            gain = (B.T @ riccati).ravel()
            free = np.linalg.solve(np.hstack([A[:, 1:], B]), -A[:, 0])
            wanted = float(free[-1] + gain @ np.concatenate([[1.0], free[:-1]]))
            if not self.feels_forces:
                settled = -np.linalg.solve(A[FELT:, FELT:], A[FELT:, :FELT])
                gain = np.concatenate([gain[:FELT] + gain[FELT:] @ settled, [0.0, 0.0]])
                A, B = A[:FELT, :FELT] + A[:FELT, FELT:] @ settled, B[:FELT]
            self._laws[key] = self._foretold(gain, A, B, wanted)
        return self._laws[key]

    def _foretold(self, gain: Array, A: Array, B: Array, wanted: float) -> Law:
        n, late = len(A), len(self._torques)
        both = np.zeros((n + 1, n + 1))
        both[:n, :n], both[:n, n:] = A, B
        tick = expm(both * self.dt)
        row, past = gain[:n].copy(), np.empty(late)
        for i in range(late - 1, -1, -1):  # the newest torque first
            past[i] = row @ tick[:n, n]
            row = row @ tick[:n, :n]
        return Law(np.concatenate([row, np.zeros(8 - n)]), past, wanted)


def lateral_model(machine: Machine, speed: float) -> tuple[Array, Array]:
    """A and B of x' = A x + B tau, riding straight ahead, hips held: x as in `models.motorcycle`, shapes (8, 8) and (8, 1).

    Args:
        machine: the machine.
        speed: m/s.
    """
    whole, inputs = machine.linearised(machine.upright(speed), np.zeros(len(INPUTS)))
    names = (
        "roll",
        "steer",
        "y_rate",
        "yaw_rate",
        "roll_rate",
        "steer_rate",
        "front_lateral_force",
        "rear_lateral_force",
    )
    places = [STATES.index(name) for name in names]
    A, B = whole[np.ix_(places, places)], inputs[places, :1]
    # v_y = y' + h phi' - v psi: of the road point, across the machine
    across = np.eye(8)
    across[2, 4] = machine.parameters.sharp.h
    A = across @ A @ np.linalg.inv(across)
    A[2, 3] -= speed
    return A, across @ B
