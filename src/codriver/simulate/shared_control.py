"""Haptic shared control on the circuit: driver and assist motor turn one steering column.

    J_s delta_s'' + b_s delta_s' + T_c sign(delta_s') = T_dr + T_a + T_aln

T_dr is what the two-point driver's arms do about the wheel angle (`circuit`): a motor that turns the wheel to where he wants it
makes him pull less, one that turns it elsewhere makes him pull against it. T_a: `assist`. What he expects of the column can come to
terms with a motor that takes a share of his own torque:

    K_r -> K_r (1 - u g / (1 + g)),     u from 0, he knows the column alone, to 1, he is used to the motor

A driver model foretells his torque at its own ticks and from what is measured until then: angle and torque by sensors, car and
road as the log of the circuit has them, and the road ahead as a map has it. Between its ticks its last word holds.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from math import isfinite, nan

import numpy as np

from codriver.errors import UsageError
from codriver.models.road_sight import PathAhead
from codriver.program import Program
from codriver.signals.signal import Array
from codriver.simulate.assist import UNKNOWN, Assist, AssistState, Foretold, advance
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, Seen, circuit_path, simulate_circuit

_AHEAD = "road_curvature_ahead_"


@dataclass(frozen=True)
class SharedSetting:
    """A shared drive.

    Attributes:
        circuit: driver, car, laps.
        assist: beside him.
        used_to_it: u.

    Raises:
        UsageError: u is not between 0 and 1.
    """

    circuit: CircuitSetting = field(default_factory=CircuitSetting)
    assist: Assist = field(default_factory=Assist)
    used_to_it: float = 1.0

    def __post_init__(self) -> None:
        if not 0 <= self.used_to_it <= 1:
            raise UsageError(f"a driver who is used to it by {self.used_to_it:g}", "0 to 1", "change the setting")

    def driven(self) -> CircuitSetting:
        """The circuit's setting with the driver's expectation of the column."""
        driver, assist = self.circuit.driver, self.assist
        if assist.kind not in ("present", "predicted"):
            return self.circuit
        share = 1 - self.used_to_it * assist.gain / (1 + assist.gain)
        return replace(self.circuit, driver=replace(driver, column_gain=driver.column_gain * share))


@dataclass(frozen=True, eq=False)
class SharedDrive:
    """What happened; columns of shape (n,).

    Attributes:
        setting: what was asked for.
        drive: the drive; the motor's torque is in it.
        authority: alpha.
        foretold, foretold_sd: the driver model's word at each tick, N m; NaN where there is none.
        horizon: h, s; NaN without a driver model.
    """

    setting: SharedSetting
    drive: CircuitDrive
    authority: Array
    foretold: Array
    foretold_sd: Array
    horizon: float

    def foretold_error(self) -> float:
        """RMSE of the driver model in the loop, N m; NaN without one."""
        if not isfinite(self.horizon):
            return nan
        ahead = round(self.horizon / self.drive.setting.dt)
        off = self.foretold[:-ahead] - self.drive.driver_torque[ahead:]
        return float(np.sqrt(np.nanmean(off**2)))


def simulate_shared(setting: SharedSetting, model: Program | None = None, *, seed: int = 0) -> SharedDrive:
    """Drive with an assist motor.

    Args:
        setting: driver, car, laps, assist.
        model: driver model, compiled, with the output `driver_torque_ahead`; only "predicted" needs one.
        seed: of the driver's variability and the sensors' noise.

    Raises:
        UsageError: the car leaves the road; "predicted" without a driver model, or with one that wants what is not measured here.
    """
    circuit = setting.driven()
    path, n = circuit_path(circuit)
    helper = Helper(setting.assist, circuit, path, n, model)
    drive = simulate_circuit(circuit, seed=seed, motor=helper)
    columns = np.array(helper.kept).T
    return SharedDrive(setting, drive, columns[0], columns[1], columns[2], helper.horizon)


class Helper:
    """The motor of one drive, tick by tick.

    Attributes:
        horizon: of the driver model, s; NaN without one.
        kept: authority, foretold torque and sd at each tick.
    """

    def __init__(
        self, assist: Assist, circuit: CircuitSetting, path: PathAhead, n: int, model: Program | None = None
    ) -> None:
        if assist.kind == "predicted" and model is None:
            raise UsageError(
                "a predicted torque and no driver model", "a driver model", "give one: codriver driver fit"
            )
        self.assist, self.kept = assist, list[tuple[float, float, float]]()
        self._dt, self._speed = circuit.dt, circuit.car.speed
        self._far = assist.ahead * self._speed
        self._bend = path.bend(path.distance[:n], self._far).tolist()
        self._state = AssistState()
        self._model = _Model(model, circuit, path, n) if assist.kind == "predicted" and model is not None else None
        self.horizon = self._model.horizon if self._model is not None else nan

    def __call__(self, k: int, seen: Seen) -> float:
        """The motor's torque at a tick, N m."""
        foretold = self._model.foretell(k, seen) if self._model is not None else UNKNOWN
        turning = self._far * (seen.heading + seen.sideslip + self._far * seen.yaw_rate / (2 * self._speed))
        error = self._far * self._bend[k] - seen.offset - turning
        self._state = advance(self.assist, self._state, self._dt, seen.torque, error, foretold)
        self.kept.append((self._state.authority, foretold.torque, foretold.sd))
        return self._state.torque


class _Model:
    """A driver model that runs beside the drive, at its own ticks."""

    def __init__(self, program: Program, circuit: CircuitSetting, path: PathAhead, n: int) -> None:
        observer = program.observer
        self.every = round(observer.dt / circuit.dt)
        if self.every < 1 or abs(self.every * circuit.dt - observer.dt) > 1e-9:
            raise UsageError(
                f"a driver model that ticks every {observer.dt:g} s in a drive that ticks every {circuit.dt:g} s",
                "whole multiples", "change the drive's tick",
            )  # fmt: skip
        self.horizon, step = (float(observer.settings.get(name, nan)) for name in ("horizon", "road_step"))
        previews = [name for name in observer.channels if name.startswith(_AHEAD)]
        known = {"steering_wheel_angle", "driver_torque", "steering_wheel_torque", "sideslip_angle", "yaw_rate",
                 "road_curvature", "longitudinal_speed", *previews}  # fmt: skip
        lacking = [name for name in observer.channels if name not in known]
        if lacking or not isfinite(self.horizon) or (previews and not isfinite(step)):
            raise UsageError(
                f"a driver model that wants {', '.join(lacking) or 'no horizon'}", f"one of {', '.join(sorted(known))}",
                "learn it from drives of codriver simulate circuit",
            )  # fmt: skip
        self._stepper, self._speed = program.live(), circuit.car.speed
        places = path.distance[: n : self.every, None] + self._speed * step * np.array(
            [int(name.removeprefix(_AHEAD)) for name in previews]
        )
        road = np.interp(places, path.distance, path.curvature)
        self._road = [dict(zip(previews, row, strict=True)) for row in road.tolist()]
        # What was said of the torque at each of the ticks until h from now, the oldest first.
        self._said: deque[float] = deque([nan] * round(self.horizon / circuit.dt))
        self._last = UNKNOWN

    def foretell(self, k: int, seen: Seen) -> Foretold:
        """What is foretold at a tick."""
        if k % self.every == 0:
            out = self._stepper.step({
                "steering_wheel_angle": seen.angle, "driver_torque": seen.torque, "steering_wheel_torque": seen.torque,
                "sideslip_angle": seen.sideslip, "yaw_rate": seen.yaw_rate, "road_curvature": seen.curvature,
                "longitudinal_speed": self._speed, **self._road[k // self.every],
            })  # fmt: skip
            torque, sd = out["driver_torque_ahead"], out["driver_torque_ahead_sd"]
            self._last = Foretold(torque, sd, nan) if out["valid"] > 0.5 else UNKNOWN
        self._said.append(self._last.torque)
        return self._last._replace(of_now=self._said.popleft())
