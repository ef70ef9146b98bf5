"""One live call: a row of numbers in, a row of numbers out, as on a running bus; beside filterpy's predict and update."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from measure import Row, compared, duration, measure, say

import codriver as cd
from codriver.models import intention_model
from codriver.observers import ESTIMATORS, design_scaled_gain

CALLS = 20_000
LIMIT = 5e-6  # s, of one call
TYPICAL = {
    "longitudinal_speed": 20.0, "longitudinal_acceleration": 0.1, "accelerator_pedal": 0.2, "brake_pressure": 0.0,
    "brake_switch": 0.0, "engine_torque": 80.0, "engine_torque_request": 85.0, "gear": 3.0, "clutch": 0.0,
    "steering_wheel_angle": 0.1, "alignment_torque": -0.2,
}  # fmt: skip


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    calls = CALLS // 10 if quick else CALLS
    other = _filterpy(calls)
    car, wheel = cd.load_vehicle("bisoffi2017"), cd.load_vehicle("okamoto2019")
    # The others of the driver's torque differ from the first in where the known torque is from.
    steered = ("driver-torque-logged", "driver-torque-pi")
    for name in (*(n for n, e in ESTIMATORS.items() if e.family == "intent"), *steered):
        say(f"  {name}")
        observer = cd.build(name, wheel if name in steered else car)
        stepper = cd.compile(observer).live()
        values = {channel: TYPICAL[channel] for channel in observer.channels}
        row = [*values.values(), *[1] * len(observer.flags)]

        def quickly(stepper=stepper, row=row) -> None:
            for _ in range(calls):
                stepper(row)

        def easily(stepper=stepper, values=values) -> None:
            for _ in range(calls):
                stepper.step(values)

        fast, easy = measure(quickly, 7), measure(easily, 5)
        outputs = f"{len(stepper.inputs)} numbers in, {len(stepper.outputs)} out"
        yield Row(
            f"one live call, {name}", f"{duration(fast.best / calls)} (+{fast.spread})",
            target=f"at most {duration(LIMIT)}", met=fast.best / calls <= LIMIT, note=f"Stepper.__call__; {outputs}",
        )  # fmt: skip
        if name == "kinematic":
            yield compared(
                f"one live call, {name}", fast.best / calls, "filterpy predict + update", other / calls,
                "filterpy has no standstill, validity or noise scale", None, fast.spread,
            )  # fmt: skip
        yield Row(
            f"one live step by names, {name}",
            f"{duration(easy.best / calls)} (+{easy.spread})",
            note="Stepper.step, dicts",
        )


def _filterpy(calls: int) -> float:
    """The same Kalman filter, a predict and an update a call, s for all calls."""
    from filterpy.kalman import KalmanFilter

    design = design_scaled_gain("bisoffi2017", 0.01)
    kf = KalmanFilter(dim_x=4, dim_z=2)
    kf.F, kf.H, kf.Q, kf.R, kf.P = design.F, intention_model().C, design.Qd, design.Rd, design.P.copy()
    kf.x = np.array([[20.0], [0.0], [0.1], [0.0]])
    y = np.array([[0.1], [20.0]])

    def work() -> None:
        for _ in range(calls):
            kf.predict()
            kf.update(y)

    return measure(work, 3).best
