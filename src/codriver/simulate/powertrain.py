"""Engine, automatic clutch and robotised gearbox with their control unit.

Engine, with lag t_e, speed omega (rad/s) and net torque T_e (N m, what the bus calls actual torque):

    t_e T_e' = T_wanted - T_e,   J omega' = T_e - T_c  while the clutch slips,   omega = v tau / eta  while it is locked

Most of the time T_wanted is the driver's request T_r = c_r p_r; with the pedal released it goes over to the engine's
drag. The clutch passes T_c: T_e when locked, at most T_MAX (1 - c)^3 when slipping (c: 0 closed, 1 open; diaphragm
springs build up force late in their travel). A gear shift goes

    CUT     the control unit takes the torque away, the clutch still closed
    OPEN    no torque passes; the gear changes half-way; the engine is brought to its new speed by its drag (upshift) or
            by a burst of torque (downshift; 2015, section V and figure 3)
    CLOSE   the clutch slips, then locks; the torque is handed back to the driver at a bounded rate

and the driver may do as he likes meanwhile. STAND holds the clutch open at idle, LAUNCH lets it slip to get the car
going.
"""

from __future__ import annotations

import math

from codriver.simulate.car_parameters import CarParameters

LOCKED, CUT, OPEN, CLOSE, STAND, LAUNCH = range(6)
T_MAX = 400.0  # clutch torque when fully closed, N m
SLIP = 4.0  # slip over which the friction torque changes sign, rad/s
STALL = 75.0  # engine speed below which the clutch opens, rad/s
HAND_BACK = 350.0  # fastest rise of torque handed back after a shift, N m/s
MINIMUM_STAY = 1.2  # between two shifts, s
PATIENCE = 4.0  # after a shift, before the pedal can ask for a lower gear, s; else the box would hunt
# Shift speeds of the engine, rad/s: at released pedal, and their growth with it. A shift up must not land below the
# speed of the shift down at the same pedal, or the box hunts: UP * tau_next / tau > DOWN.
UP_BASE, UP_PEDAL = 215.0, 170.0
DOWN_BASE, DOWN_PEDAL = (0.0, 92.0, 104.0, 108.0, 112.0), (0.0, 50.0, 110.0, 125.0, 130.0)  # by gear
RELEASED = 2.5  # with the pedal released for this long the box shifts up again, s
SLIP_DECAY = 0.11  # time constant with which the closing clutch takes away slip, s


class Powertrain:
    """State of engine, clutch and gearbox.

    Attributes:
        gear: engaged gear, 1...
        clutch: 0 closed to 1 open.
        phase: LOCKED, CUT, OPEN, CLOSE, STAND or LAUNCH.
        request: T_r, N m.          torque: T_e, N m.
        passed: T_c, N m.           force: tau T_c, N.
        speed: of the engine, rad/s.
        direction: of the shift under way, 1 up, -1 down, else 0.
    """

    __slots__ = (
        "_elapsed",
        "_next",
        "_p",
        "_released",
        "_since",
        "_slipping",
        "_tau",
        "clutch",
        "direction",
        "force",
        "gear",
        "passed",
        "phase",
        "request",
        "speed",
        "torque",
    )

    def __init__(self, parameters: CarParameters, v: float = 0.0) -> None:
        self._p, self._tau = parameters, parameters.transmission
        self.gear = 1
        while self.gear < len(self._tau) and v * self._tau[self.gear - 1] / parameters.efficiency > UP_BASE:
            self.gear += 1
        self.phase, self.clutch = (LOCKED, 0.0) if v > 3.0 else (STAND, 1.0)
        self.speed = max(parameters.idle, v * self._tau[self.gear - 1] / parameters.efficiency)
        self.torque = self.passed = self.force = self.request = 0.0
        self.direction, self._next = 0, self.gear
        self._elapsed, self._since, self._released, self._slipping = 0.0, 10.0, 0.0, self.phase == STAND

    @property
    def tau(self) -> float:
        """Transmission coefficient of the engaged gear, 1/m."""
        return self._tau[self.gear - 1]

    @property
    def shifting(self) -> bool:
        """Whether a gear shift is under way."""
        return self.direction != 0

    def step(self, dt: float, pedal: float, braking: bool, v: float) -> None:
        """Advance by dt seconds.

        Args:
            dt: s.
            pedal: accelerator, 0..1.
            braking: whether the brake is pressed.
            v: speed of the car, m/s.
        """
        p = self._p
        shaft = v * self._tau[self.gear - 1] / p.efficiency  # clutch output, rad/s
        self.request = p.pedal * pedal
        phase = self.phase
        self._elapsed += dt
        self._since += dt
        self._released = 0.0 if pedal > 0.02 else self._released + dt
        if phase == LOCKED:
            wanted = self._demand(pedal)
            if self._since < 2.0:  # the torque of the last shift is still being handed back
                wanted = min(wanted, self.torque + HAND_BACK * p.engine_lag)
            if shaft < STALL:
                self._enter(STAND)
            else:
                self._choose_gear(pedal, braking, shaft, v)
        elif phase == CUT:
            wanted = 0.0
            if self._elapsed >= p.cut:
                self._enter(OPEN)
        elif phase == OPEN:
            self.clutch = min(1.0, self.clutch + dt / 0.06)
            target = v * self._tau[self._next - 1] / p.efficiency + (8.0 if self.direction < 0 else 0.0)
            wanted = max(-60.0, min(130.0, p.engine_inertia * (target - self.speed) / 0.06))
            if self.clutch < 0.95:  # not yet: the wheels would feel it
                wanted = 0.0
            if self._elapsed >= 0.5 * p.open_time:
                self.gear = self._next
            if self._elapsed >= p.open_time:
                self._enter(CLOSE)
        elif phase == CLOSE:
            wanted = min(self._demand(pedal), max(self.torque, 0.0) + HAND_BACK * p.engine_lag)
            if self._slipping:  # the clutch carries what the engine gives, and what brings the slip down gently
                share = min(1.0, self._elapsed / (0.6 * p.close))
                slip = self.speed - shaft
                aim = (self.torque if slip > 0.0 else -self.torque) + p.engine_inertia * abs(slip) / SLIP_DECAY + 12.0
                position = 1.0 - (max(0.0, min(0.95 * T_MAX, share * aim)) / T_MAX) ** (1.0 / 3.0)
                self.clutch += max(-dt / 0.12, min(dt / 0.12, position - self.clutch))
            else:
                self.clutch = max(0.0, self.clutch - dt / 0.15)
            if shaft < STALL:
                self._enter(STAND)
            elif self.clutch == 0.0 and not self._slipping:
                self._enter(LOCKED)
        else:
            wanted = self._stand_or_launch(dt, pedal, braking, shaft)
        self.torque += dt * (wanted - self.torque) / p.engine_lag
        self._pass_torque(dt, shaft)

    def _demand(self, pedal: float) -> float:
        """The torque for a pedal position: the request, going over to engine drag over the first 6 % of the pedal."""
        p, turning = self._p, self.speed
        demand = self.request
        if pedal < 0.06:
            # Idle control takes the drag away towards idle speed, so that a closed clutch can creep.
            fade = min(1.0, max(0.0, (turning - p.idle) / 30.0))
            demand -= fade * (p.friction + p.friction_slope * turning) * (1.0 - pedal / 0.06)
        return demand if turning < 470.0 else demand * max(0.0, (500.0 - turning) / 30.0)

    def _choose_gear(self, pedal: float, braking: bool, shaft: float, v: float) -> None:
        """Begin a shift where engine speed and pedal ask for one."""
        if self._since < MINIMUM_STAY:
            return
        gear, taus, eta = self.gear, self._tau, self._p.efficiency
        steady = not braking and (self._released == 0.0 or self._released > RELEASED)
        if gear < len(taus) and shaft > UP_BASE + UP_PEDAL * pedal and steady:
            self._begin_shift(gear + 1)
            return
        asked = pedal if self._since > PATIENCE else 0.0
        if gear > 1 and shaft < DOWN_BASE[gear - 1] + DOWN_PEDAL[gear - 1] * asked:
            lower = gear - 1
            # When slowing down quickly a gear may be skipped.
            while braking and lower > 1 and v * taus[lower - 1] / eta < DOWN_BASE[lower - 1] + 15.0:
                lower -= 1
            self._begin_shift(lower)

    def _begin_shift(self, gear: int) -> None:
        self._next, self.direction = gear, 1 if gear > self.gear else -1
        self._enter(CUT)

    def _enter(self, phase: int) -> None:
        self.phase, self._elapsed = phase, 0.0
        if phase == LOCKED:
            self.direction, self._since, self.clutch = 0, 0.0, 0.0
        elif phase == STAND:
            self.direction, self._slipping = 0, True
        elif phase in (OPEN, LAUNCH):
            self._slipping = True

    def _stand_or_launch(self, dt: float, pedal: float, braking: bool, shaft: float) -> float:
        """Clutch and wanted torque at standstill, rolling slower than the engine can, and getting under way."""
        p = self._p
        if self.phase == STAND:
            self.clutch = min(1.0, self.clutch + dt / 0.12)
            if self._elapsed > 0.25:
                self.gear = 1
            if pedal > 0.02 and not braking and self.gear == 1:
                self._enter(LAUNCH)
            return max(-20.0, min(60.0, p.engine_inertia * (p.idle - self.speed) / 0.15))
        # LAUNCH: the clutch passes what the engine gives, and a little less while the engine is below its launch speed.
        aim = 120.0 + 70.0 * pedal
        capacity = max(0.0, min(0.9 * T_MAX, self.torque + 2.0 * (self.speed - aim)))
        position = 1.0 - (capacity / T_MAX) ** (1.0 / 3.0)
        self.clutch += max(-dt / 0.15, min(dt / 0.15, position - self.clutch))
        if not self._slipping:
            self._enter(CLOSE)
        elif (pedal < 0.01 and self._elapsed > 0.3) or braking:
            self._enter(STAND if shaft < STALL else CLOSE)
        return self._demand(pedal)

    def _pass_torque(self, dt: float, shaft: float) -> None:
        """The torque through the clutch, and the engine's speed."""
        if self._slipping:
            shut = 1.0 - self.clutch
            capacity = T_MAX * shut * shut * shut
            slip = self.speed - shaft
            if capacity > abs(self.torque) + 1.0 and abs(slip) < 1.5 * SLIP and self.phase in (CLOSE, LAUNCH):
                self._slipping = False
            else:
                self.passed = capacity * math.tanh(slip / SLIP)
                self.speed = max(40.0, self.speed + dt * (self.torque - self.passed) / self._p.engine_inertia)
        if not self._slipping:
            self.passed, self.speed = self.torque, shaft
        self.force = self._tau[self.gear - 1] * self.passed
