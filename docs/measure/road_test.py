"""Figures of docs/road-test.md: what a drive costs, how the six drivers differ, odometer, the 2015 car's tau.

python docs/measure/road_test.py             about a minute
"""

# ruff: noqa: T201
from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np
from drives import rms, table

import codriver as cd
from codriver.simulate import (
    CAR_2015,
    PRINTED_2015,
    ROAD_TEST_STRETCHES,
    STYLES,
    RoadTest,
    nominal_2015,
    road_test,
    road_test_road,
    track_test,
)
from codriver.simulate import drive as simulate
from codriver.simulate.bus import transmit
from codriver.simulate.judge import judge
from codriver.simulate.road_test import decoded
from codriver.simulate.sensors import Instruments

LINE = 26_992.0  # where the ramp's low speed begins, m


def drivers() -> None:
    """The whole way, each driver once."""
    rows = []
    for name, style in STYLES.items():
        trace = simulate(road_test_road(), 7200.0, style=style, seed=1, record_every=5)
        place, v = trace["distance"], trace["speed"]
        part = ROAD_TEST_STRETCHES["comparison"].holds(place)
        cruise = v[(place > LINE - 600) & (place < LINE - 400)].mean()
        begins = LINE - float(place[(place < LINE) & (v >= 0.95 * cruise)][-1])
        rows.append(
            [
                name, f"{trace['time'][-1] / 60:.1f}", f"{rms(trace['planned_jerk']):.2f}",
                f"{rms(trace['planned_jerk'][part]):.2f}", f"{rms(trace['pedal_rate'][part]):.2f}",
                f"{rms(trace['brake_rate'][part]) / 1e5:.1f}", f"{begins:.0f}",
                f"{trace['time'][part][0]:.0f} to {trace['time'][part][-1]:.0f}",
            ]
        )  # fmt: skip
    head = ["driver", "minutes", "jerk, whole", "jerk", "pedal 1/s", "brake bar/s", "begins m", "stretch s"]
    print(table(head, rows))


def odometer(test: RoadTest) -> None:
    """Error of the speed in the log."""
    speed, trace = test.log["longitudinal_speed"], test.trace
    at = speed.time - test.bus.latency
    true, pace = (np.interp(at, trace["time"], trace[name]) for name in ("speed", "acceleration"))
    steady = (true > 3) & (np.abs(pace) < 0.1)
    error = speed.values - true
    print(f"odometer: sd {error[true > 3].std():.4f} m/s above 3 m/s, {error[steady].std():.4f} at steady speed")
    lag = -np.polyfit(pace[true > 3], error[true > 3], 1)[0]
    print(f"it is late by {lag * 1000:.1f} ms")


def main() -> None:
    """Measure and print."""
    road_test(duration=20.0)  # wakes scipy and cantools once
    begin = perf_counter()
    test = road_test()
    parts = [begin, perf_counter()]
    trace = simulate(road_test_road(), 7200.0, record_every=5)
    parts.append(perf_counter())
    transmit(Instruments(trace, test.sensors, 1), float(trace["time"][-1]), test.bus)
    parts.append(perf_counter())
    decoded(test.frames, "frames")
    parts.append(perf_counter())
    print("road test {:.1f} s; alone: driving {:.1f}, sensors and bus {:.1f}, decoding {:.1f}".format(*np.diff(parts)))
    print(f"{trace['distance'][-1]:.0f} m, {trace['time'][-1]:.0f} s")
    shifts, share = np.count_nonzero(np.diff(trace["gear"])), trace.braking.mean()
    stands = np.count_nonzero((trace["speed"][:-1] > 0.05) & (trace["speed"][1:] <= 0.05))
    print(f"{shifts} changes of gear, braking {share:.0%}, {stands} stops, {len(test.frames)} frames")
    lengths = [hole.length for hole in test.bus.holes]
    print(f"{len(lengths)} holes, {min(lengths):.2f} to {max(lengths):.2f} s")
    odometer(test)
    drivers()
    laps, literal = track_test(), track_test(car=replace(CAR_2015, transmission=PRINTED_2015))
    for name, lap in (("tau / r_r", laps), ("printed tau", literal)):
        trace = lap.trace
        print(
            f"track, true {name}: {trace['time'][-1]:.0f} s, gears up to {trace['gear'].max():.0f}, "
            f"pedal up to {trace['pedal'].max():.2f}"
        )
        for what, vehicle in (("printed", cd.load_vehicle("bisoffi2015")), ("tau / r_r", nominal_2015())):
            row = judge(cd.estimate_log("intent-torque", lap.log, vehicle, ell=1.4), lap.truth)[2]
            print(f"   estimator with {what}: {row.what}: {row.error:.3f} m/s^3, answering zero {row.zero:.3f}")


if __name__ == "__main__":
    main()
