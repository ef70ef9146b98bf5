"""From BLF to Parquet: our command against what one would put together from the usual libraries.

Both start from the same ten minutes of CAN at 2,000 frames/s. The alternative reads with python-can, decodes the messages
it needs with cantools, a frame at a time, holds the signals onto 100 Hz with pandas, forms the known input with numpy,
filters with filterpy, and writes the same columns with pyarrow. Its filter has no standard deviation from learnt noise,
no standstill and no checks, so ours does more.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np
from car_log import CarLog, write_car_log
from measure import Row, compared, measure, say
from start import estimate_command

import codriver as cd
from codriver.observers import design_scaled_gain

DT = 0.01
# Standard name: channels, factor to SI. Of the rear wheels the mean.
SIGNALS = {
    "longitudinal_speed": (("Wheels.WHL_SpeedRL", "Wheels.WHL_SpeedRR"), 1 / 3.6),
    "longitudinal_acceleration": (("Dynamics.ESC_AccelX",), 1.0),
    "accelerator_pedal": (("PedalData.APP_Position",), 0.01),
    "brake_pressure": (("Brakes.BRK_MasterCylinder",), 1e5),
    "brake_switch": (("Brakes.BRK_PedalSwitch",), 1.0),
    "engine_torque": (("EngineData.ENG_TorqueActual",), 1.0),
    "gear": (("Gearbox.TCU_GearEngaged",), 1.0),
    "clutch": (("Gearbox.TCU_ClutchOpen",), 0.01),
}


def run(quick: bool = False) -> Iterator[Row]:
    """One row."""
    seconds, part = (60.0, 20.0) if quick else (600.0, 60.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        say("  writing the log")
        log = write_car_log(folder, seconds)
        (folder / "part").mkdir()
        short = write_car_log(folder / "part", part)
        say(f"  codriver estimate intent-pedals, {log.frames} frames")
        ours = measure(lambda: _estimate(log, folder / "ours.parquet"), 2 if quick else 5)
        say(f"  python-can, cantools, pandas, filterpy on {short.frames} frames")
        start = time.perf_counter()
        rows = _alternative(short, folder / "other.parquet")
        other = (time.perf_counter() - start) * log.frames / short.frames
        agreement = _agreement(folder / "ours.parquet", rows)
        note = (
            f"{log.seconds:g} s, {log.frames} frames, the command in this process, imports done; alternative measured on "
            f"{short.seconds:g} s and scaled; {agreement}"
        )
        name = "python-can + cantools + pandas + filterpy"
        yield compared("BLF to Parquet, intent-pedals", ours.best, name, other, note, 5, ours.spread)


def _estimate(log: CarLog, out: Path) -> None:
    """The command, in this process."""
    from codriver.cli.app import app

    command = estimate_command(log, "intent-pedals", out)
    silent = mock.patch("rich.console.Console.print")
    with mock.patch.object(sys, "argv", ["codriver", *command]), silent:
        app(command, standalone_mode=False)


def _alternative(log: CarLog, out: Path) -> np.ndarray:
    """The same with the usual libraries; the filtered states, shape (n, 4), with their times in front."""
    import can
    import cantools.database
    import pandas as pd

    database = cantools.database.load_file(log.dbc)
    names = {channel.split(".")[0] for channels, _ in SIGNALS.values() for channel in channels}
    wanted = {message.frame_id: message.name for message in database.messages if message.name in names}
    rows: dict[str, list[dict]] = {name: [] for name in names}
    first = None
    with can.BLFReader(str(log.blf)) as reader:
        for message in reader:
            first = message.timestamp if first is None else first
            name = wanted.get(message.arbitration_id)
            if name is not None:
                signals = database.decode_message(message.arbitration_id, message.data, decode_choices=False)
                rows[name].append({"time": message.timestamp - first, **signals})
    ticks = pd.DataFrame({"time": np.arange(0.0, log.seconds, DT)})
    columns, fresh = {}, {}
    tables = {name: pd.DataFrame(found).sort_values("time") for name, found in rows.items()}
    for name, (channels, factor) in SIGNALS.items():
        table = tables[channels[0].split(".")[0]]
        values = sum(table[channel.split(".")[1]] for channel in channels) / len(channels) * factor
        stamped = pd.DataFrame({"time": table["time"], "stamp": table["time"], name: values})
        held = pd.merge_asof(ticks, stamped, on="time")
        columns[name] = held[name].to_numpy()
        fresh[name] = held["stamp"].diff().fillna(1.0).to_numpy() > 0
    states, deviations = _filter(columns, fresh)
    titles = ("longitudinal_speed", "intentional_acceleration", "acceleration_offset", "intentional_jerk")
    table = pd.DataFrame({"time": ticks["time"]})
    for k, title in enumerate(titles):
        table[title], table[f"{title}_sd"] = states[:, k], deviations[:, k]
    for name, values in columns.items():
        table[f"input.{name}"] = values
    table.to_parquet(out, compression="zstd")
    return np.column_stack([ticks["time"], states])


def _filter(columns: dict[str, np.ndarray], fresh: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The known input (2017 eq. 10a) and the Kalman filter with it, a row of measurements at a time."""
    from filterpy.kalman import KalmanFilter

    car = cd.load_vehicle("bisoffi2017")
    mass, ratios = car.number("mass"), np.array([0.0, *car.numbers("transmission")])
    pedal, brake = car.number("pedal_coefficient"), car.number("brake_coefficient")
    tau = ratios[np.nan_to_num(columns["gear"]).astype(int)]
    braking = columns["brake_switch"] > 0
    wanted = (
        np.where(braking, 0.0, tau * pedal * columns["accelerator_pedal"] + brake * columns["brake_pressure"]) / mass
    )
    known = np.nan_to_num(tau / mass * (1 - columns["clutch"]) * columns["engine_torque"] - wanted)
    design = design_scaled_gain("bisoffi2017", DT)
    kf = KalmanFilter(dim_x=4, dim_z=1, dim_u=1)
    kf.F, kf.Q, kf.P = design.F, design.Qd, 25 * np.diag(np.diag(design.P))
    kf.B = np.array([[DT], [0.0], [0.0], [0.0]])
    row_a, row_v = np.array([[0.0, 1.0, 1.0, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]])
    a, v = columns["longitudinal_acceleration"], columns["longitudinal_speed"]
    fresh_a, fresh_v = fresh["longitudinal_acceleration"] & np.isfinite(a), fresh["longitudinal_speed"] & np.isfinite(v)
    states, deviations = np.empty((a.size, 4)), np.empty((a.size, 4))
    for k in range(a.size):
        kf.predict(u=known[k])
        if fresh_a[k]:
            kf.update(a[k] - known[k], R=design.Rd[0, 0], H=row_a)
        if fresh_v[k]:
            kf.update(v[k], R=design.Rd[1, 1], H=row_v)
        states[k], deviations[k] = kf.x[:, 0], np.sqrt(np.diag(kf.P))
    return states, deviations


def _agreement(ours: Path, rows: np.ndarray) -> str:
    """How near the alternative's speed and jerk are to ours where ours is valid, as text.

    Raises:
        ValueError: they are not the same estimates.
    """
    import pyarrow.parquet as pq

    table = pq.read_table(ours, columns=["time", "longitudinal_speed", "intentional_jerk", "valid"]).to_pydict()
    time_, valid = np.array(table["time"]), np.array(table["valid"], bool)
    inside = valid & (time_ < rows[-1, 0])
    apart = {}
    for k, name in ((1, "longitudinal_speed"), (4, "intentional_jerk")):
        values = np.array(table[name], float)[inside]
        apart[name] = float(np.sqrt(np.mean((np.interp(time_[inside], rows[:, 0], rows[:, k]) - values) ** 2)))
    if apart["longitudinal_speed"] > 0.3 or apart["intentional_jerk"] > 1.0:
        raise ValueError(f"the estimates differ: {apart}")
    return "rms difference where valid: " + ", ".join(f"{name} {x:.2g}" for name, x in apart.items())
