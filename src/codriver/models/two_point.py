"""The two-point visual driver that steers by torque: anticipation on a far point, compensation on a near one, and arms.

    a = K_p theta_far                                                       anticipation: wheel angle, rad
    c = K_c / v  (T_L s + 1) / (T_I s + 1)  theta_near                      compensation: wheel angle, rad
    d = exp(-tau_p s) (a + c)                                               wanted wheel angle, after the processing delay
    T_dr = 1 / (T_N s + 1) [K_r v d + K_t (d - delta_s)]                    torque of the hands, N m

theta_near, theta_far: directions of the two points, rad (`road_sight`). delta_s: wheel angle, rad. v: speed, m/s. K_p, -; K_c,
m/s; T_L, T_I, tau_p, T_N, s. K_r v is the torque per angle that the driver expects the tyres to ask for (internal model of the
column), K_r in N s/rad; K_t, N m/rad, is the stiffness of arms and stretch reflex that pull the wheel to where it is wanted.

At one speed only K_h = K_r v + K_t and K_t show in the torque: T_dr = 1 / (T_N s + 1) [K_h d - K_t delta_s]. So K_r, K_p and K_c
cannot be told apart from drives at one speed; K_h K_p, K_h K_c and K_t can.

The points are from Salvucci, Gray 2004, doi:10.1068/p5343; blocks and letters follow Sentouh, Chevrel, Mars, Claveau 2009, "A
sensorimotor driver model for steering control" (IEEE SMC, 2462-2467), and the neuromuscular part with K_r and K_t the same
group's later form: Saleh, Chevrel, Claveau, Lafay, Mars 2013, "Shared steering control between a driver and an automation" (IEEE
Transactions on Intelligent Transportation Systems 14(2), 974-983). Their far angle is that of the tangent point; here it is that
of a point of the path some time ahead. The default values are this project's: they drive the car and wheel of `simulate.rig`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, floor, isfinite

import numpy as np

from codriver.models.state_space import StateSpace
from codriver.signals.signal import Array

INPUTS = ("near_angle", "far_angle", "steering_wheel_angle")


@dataclass(frozen=True)
class TwoPointDriver:
    """A driver.

    Attributes:
        anticipation: K_p.
        compensation: K_c, m/s.
        lead, lag: T_L, T_I, s.
        delay: tau_p, s.
        column_gain: K_r, N s/rad.
        reflex: K_t, N m/rad.
        muscle: T_N, s.
        near: distance of the near point, m.
        far: the far point is where the car will be after so many s.

    Raises:
        ValueError: a parameter is not finite, negative, or 0 where it divides.
    """

    anticipation: float = 4.4
    compensation: float = 9.0
    lead: float = 1.2
    lag: float = 0.4
    delay: float = 0.12
    column_gain: float = 0.15
    reflex: float = 6.0
    muscle: float = 0.1
    near: float = 6.0
    far: float = 1.3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            least_is_free = name in ("lag", "muscle", "near", "far")
            if not isfinite(value) or value < 0 or (least_is_free and value == 0):
                raise ValueError(f"{name} is {value:g}; it must be {'positive' if least_is_free else 'at least 0'}")

    def hold(self, speed: float) -> float:
        """K_h = K_r v + K_t, N m per rad of wanted angle."""
        return self.column_gain * speed + self.reflex

    def model(self, speed: float, order: int = 2) -> StateSpace:
        """Torque for near angle, far angle and wheel angle at one speed, with the delay as a Pade fraction.

        Args:
            speed: m/s, positive.
            order: of the fraction, 1 or 2; a delay of 0 takes no states.

        Raises:
            ValueError: the speed is not positive, or there is no such order.
        """
        if not speed > 0:
            raise ValueError(f"a speed of {speed:g} m/s; the compensation K_c / v needs a car that moves forward")
        A, B, C, D = _pade(self.delay, order)
        n, quick, gain = A.shape[0], self.lead / self.lag, self.compensation / speed
        hold, T = self.hold(speed), self.muscle
        # x = (compensation's lag, delay's states, torque); wanted = direct @ u + slow x_c, then the delay, then the muscle.
        direct = np.array([gain * quick, self.anticipation, 0.0])
        slow = gain * (1 - quick)
        F, G = np.zeros((n + 2, n + 2)), np.zeros((n + 2, 3))
        F[0, 0], G[0, 0] = -1 / self.lag, 1 / self.lag
        F[1 : n + 1, 0], F[1 : n + 1, 1 : n + 1], G[1 : n + 1] = B * slow, A, np.outer(B, direct)
        F[-1, 0], F[-1, 1 : n + 1], F[-1, -1] = hold * D * slow / T, hold * C / T, -1 / T
        G[-1] = hold * D * direct / T
        G[-1, 2] -= self.reflex / T
        H = np.zeros((1, n + 2))
        H[0, -1] = 1.0
        states = ("compensation", *(f"delay_{i + 1}" for i in range(n)), "driver_torque")
        return StateSpace(F, G, H, np.zeros((1, 3)), states, INPUTS, ("driver_torque",))

    def tick(self, dt: float, speed: float) -> DriverTick:
        """The driver's step for one tick and speed.

        Raises:
            ValueError: tick or speed is not positive.
        """
        if not (dt > 0 and speed > 0):
            raise ValueError(f"a tick of {dt:g} s at {speed:g} m/s; both must be positive")
        n = floor(self.delay / dt + 1e-9)
        return DriverTick(
            _ramp(self.lag, dt), _ramp(self.muscle, dt), self.lead / self.lag, self.anticipation, self.compensation / speed,
            self.hold(speed), self.reflex, n, max(self.delay / dt - n, 0.0),
        )  # fmt: skip

    def torque(self, near: Array, far: Array, angle: Array, speed: float, dt: float) -> Array:
        """The torque of a whole drive from rest, N m, as `DriverTick.advance` gives it tick by tick.

        Args:
            near, far, angle: theta_near, theta_far, delta_s, rad, shape (n,).
            speed: m/s.
            dt: s.
        """
        from scipy.signal import lfilter

        t = self.tick(dt, speed)
        slow = lfilter([t.lag[2], t.lag[1]], [1.0, -t.lag[0]], near)
        wanted = t.anticipation * far + t.compensation * (t.quick * near + (1 - t.quick) * slow)
        before = np.concatenate([np.zeros(t.whole + 1), wanted])
        n = wanted.size
        delayed = (1 - t.part) * before[1 : n + 1] + t.part * before[:n]
        return np.asarray(lfilter([t.muscle[2], t.muscle[1]], [1.0, -t.muscle[0]], t.hold * delayed - t.reflex * angle))


@dataclass(frozen=True)
class DriverState:
    """What a driver carries from tick to tick.

    Attributes:
        slow, near: of the compensation's lag, and its input a tick ago, rad.
        wanted: wheel angles wanted, the latest first, rad.
        pull, torque: what the muscles were told a tick ago, and give, N m.
    """

    slow: float
    near: float
    wanted: tuple[float, ...]
    pull: float
    torque: float


@dataclass(frozen=True)
class DriverTick:
    """One tick: lags are exact for inputs that run straight between ticks, and so is the delay.

    Attributes:
        lag, muscle: (keep, before, now) of x_k = keep x_{k-1} + before u_{k-1} + now u_k.
        quick: T_L / T_I.
        anticipation, compensation: K_p, K_c / v.
        hold, reflex: K_h, K_t, N m/rad.
        whole, part: of the delay, ticks.
    """

    lag: tuple[float, float, float]
    muscle: tuple[float, float, float]
    quick: float
    anticipation: float
    compensation: float
    hold: float
    reflex: float
    whole: int
    part: float

    def start(self) -> DriverState:
        """Nothing seen, nothing wanted."""
        return DriverState(0.0, 0.0, (0.0,) * (self.whole + 1), 0.0, 0.0)

    def advance(
        self, state: DriverState, near: float, ahead: float, angle: float, gain: float = 1.0, motor: float = 0.0
    ) -> tuple[DriverState, float]:
        """State and torque now.

        Args:
            state: of the tick before.
            near: theta_near, rad.
            ahead: anticipated wheel angle, K_p theta_far or another's, rad.
            angle: delta_s, rad.
            gain: of the compensation at this tick, beside K_c.
            motor: what noise adds to what the muscles are told, N m.
        """
        keep, before, now = self.lag
        slow = keep * state.slow + before * state.near + now * near
        wanted = ahead + gain * self.compensation * (self.quick * near + (1 - self.quick) * slow)
        queue = (wanted, *state.wanted)
        delayed = (1 - self.part) * queue[self.whole] + self.part * queue[self.whole + 1]
        pull = self.hold * delayed - self.reflex * angle + motor
        keep, before, now = self.muscle
        torque = keep * state.torque + before * state.pull + now * pull
        return DriverState(slow, near, queue[:-1], pull, torque), torque


def _ramp(time: float, dt: float) -> tuple[float, float, float]:
    """1 / (T s + 1) over a tick for an input that runs straight."""
    keep = exp(-dt / time)
    mean = (1 - keep) * time / dt
    return keep, mean - keep, 1 - mean


def _pade(delay: float, order: int) -> tuple[Array, Array, Array, float]:
    """A, B, C, D of a delay; B and C of shape (n,)."""
    if order not in (1, 2):
        raise ValueError(f"a Pade fraction of order {order}; there are 1 and 2")
    if delay == 0:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0
    if order == 1:
        return np.array([[-2 / delay]]), np.array([1.0]), np.array([4 / delay]), -1.0
    # (s^2 - 6 s / tau + 12 / tau^2) / (s^2 + 6 s / tau + 12 / tau^2), controllable form.
    A = np.array([[0.0, 1.0], [-12 / delay**2, -6 / delay]])
    return A, np.array([0.0, 1.0]), np.array([0.0, -12 / delay]), 1.0
