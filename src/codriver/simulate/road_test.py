"""The road test and the track test: long drives with known truth, and the log an engineer would get of them.

    road_test    53 km and about 42 minutes with the car of the 2017 paper (section IV), by one of six drivers
    track_test   two laps of a track with the car of the 2015 paper (section V)

The log is decoded from the CAN frames, through the same code and with the same database and names file as a recording:
messages at 10 to 100 Hz with jitter, single losses and holes, converters' steps, wheel speeds from teeth. Nothing of the
truth is in it. `truth` holds what was true, for judging alone.

The parameters of the simulation (`car`, `sensors`, `bus`) are the simulator's. An estimator takes its own from a
vehicle file, never from here.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from codriver.errors import UsageError
from codriver.logs.can_recording import CanRecording
from codriver.logs.frames import Frames
from codriver.logs.names_file import parse_names
from codriver.logs.read import read_recording
from codriver.names import nearest
from codriver.signals import Log
from codriver.simulate.bus import BusParameters, drop_outs, transmit
from codriver.simulate.can_layout import dbc_text
from codriver.simulate.car_parameters import CAR_2015, CarParameters
from codriver.simulate.drive import Trace, drive
from codriver.simulate.network import MESSAGES, names_text
from codriver.simulate.road import Road
from codriver.simulate.route import Stretch, road_test_road
from codriver.simulate.sensors import Instruments, SensorParameters
from codriver.simulate.styles import STYLES, Style
from codriver.simulate.track import track_road
from codriver.simulate.truth import truth_log

# Wheel speeds from a ring of 48 teeth; what scatters is the teeth and their timer.
ROAD_TEST_SENSORS = SensorParameters(teeth=48, speed_noise=0.0)
_RECORD_EVERY = 5  # steps of 2 ms: rows at 100 Hz, the rate of the quickest messages
_LONGEST = 2 * 3600.0  # s; a drive ends where its road does


@dataclass(frozen=True, eq=False)
class RoadTest:
    """A long drive.

    Attributes:
        trace: everything that happened, at 100 Hz; also who drove what and where.
        truth: the reference, 100 Hz (see `truth_log`).
        frames: the bus, with its jitter, losses and holes.
        log: the standard signals as decoded from the frames; what an estimator may see.
        sensors, bus: the imperfections that made the frames.
        seed: of the driver, the noise and the bus.
    """

    trace: Trace = field(repr=False)
    truth: Log = field(repr=False)
    frames: Frames = field(repr=False)
    log: Log = field(repr=False)
    sensors: SensorParameters
    bus: BusParameters
    seed: int

    def span(self, stretch: Stretch) -> tuple[float, float]:
        """When the car entered and left a stretch, s.

        Raises:
            UsageError: it did not get there.
        """
        inside = np.flatnonzero(stretch.holds(self.trace["distance"]))
        if inside.size == 0:
            driven = float(self.trace["distance"][-1])
            raise UsageError(
                f"the drive ends after {driven:.0f} m, before the stretch from {stretch.start:g} m on",
                "a drive that gets there",
                "drive for longer",
            )
        time = self.trace["time"]
        return float(time[inside[0]]), float(time[inside[-1]])


def road_test(
    style: str | Style = "ordinary",
    seed: int = 1,
    *,
    car: CarParameters | None = None,
    sensors: SensorParameters | None = None,
    bus: BusParameters | None = None,
    duration: float | None = None,
) -> RoadTest:
    """Drive the road test; the whole takes some ten seconds of computing.

    Args:
        style: who drives: a name of `STYLES`, or a style.
        seed: of the driver's scatter, the sensors' noise and the bus; the same seed gives the same drive.
        car: the car's true parameters; those of the 2017 paper if not given.
        sensors: their imperfections; `ROAD_TEST_SENSORS` if not given.
        bus: its imperfections; usual jitter and losses, and holes by the seed, if not given.
        duration: s; the whole way if not given.

    Raises:
        UsageError: nobody drives in that style, or the duration is too short.
    """
    return _test(road_test_road(), style, seed, car or CarParameters(), sensors, bus, duration)


def track_test(
    style: str | Style = "ordinary",
    seed: int = 1,
    *,
    laps: int = 2,
    car: CarParameters | None = None,
    sensors: SensorParameters | None = None,
    bus: BusParameters | None = None,
    duration: float | None = None,
) -> RoadTest:
    """Drive laps of the handling track with the car of the 2015 paper, `CAR_2015`.

    The paper's printed tau look as if they left out 1/r_r (`car_parameters.py`); the car here has tau / r_r, 41.5 to
    8.0 1/m. An estimator with the printed numbers is then wrong by the factor 1 / 0.313 = 3.2, one with tau / r_r is
    right. To drive a car whose true tau are the printed numbers, give `replace(CAR_2015, transmission=PRINTED_2015)`.

    Args:
        style: who drives: a name of `STYLES`, or a style.
        seed: of the driver's scatter, the sensors' noise and the bus.
        laps: how many.
        car: the car's true parameters; `CAR_2015` if not given.
        sensors: their imperfections; `ROAD_TEST_SENSORS` if not given.
        bus: its imperfections; usual jitter and losses, and holes by the seed, if not given.
        duration: s; all laps if not given.

    Raises:
        UsageError: nobody drives in that style, the duration is too short, or there is no lap.
    """
    return _test(track_road(laps), style, seed, car or CAR_2015, sensors, bus, duration)


def decoded(frames: Frames, source: str) -> Log:
    """The standard signals of the simulated car's frames, read as a recording of them would be.

    Args:
        frames: of `transmit`.
        source: for people.
    """
    with tempfile.TemporaryDirectory(prefix="codriver-") as folder:  # databases are read from files
        dbc = Path(folder) / "car.dbc"
        dbc.write_text(dbc_text(MESSAGES, "simulated car"), encoding="utf-8")
        recording = CanRecording(source, "simulated CAN", frames, dbc, None, [])
    return read_recording(recording, parse_names(names_text(), "names of the simulated car"))


def _test(
    road: Road,
    style: str | Style,
    seed: int,
    car: CarParameters,
    sensors: SensorParameters | None,
    bus: BusParameters | None,
    duration: float | None,
) -> RoadTest:
    """A drive, its frames and its log."""
    if duration is not None and not duration >= 1.0:
        raise UsageError(f"a drive of {duration:g} s", "one second or more", "drive for longer")
    sensors = sensors or ROAD_TEST_SENSORS
    trace = drive(
        road,
        min(duration or _LONGEST, _LONGEST),
        style=_style(style),
        car=car,
        seed=seed,
        record_every=_RECORD_EVERY,
    )
    stop = float(trace["time"][-1])
    bus = bus or BusParameters(holes=drop_outs(stop, seed=seed))
    frames = transmit(Instruments(trace, sensors, seed), stop, bus, seed=seed)
    log = decoded(frames, f"{road.name}; {trace.style.name} driver, seed {seed}")
    return RoadTest(trace, truth_log(trace, bias=sensors.bias), frames, log, sensors, bus, seed)


def _style(style: str | Style) -> Style:
    if isinstance(style, Style):
        return style
    if style in STYLES:
        return STYLES[style]
    near = nearest(style, STYLES)
    raise UsageError(
        f"no driver '{style}'" + (f" (did you mean {near}?)" if near else ""),
        f"one of {', '.join(STYLES)}",
        "choose one of them",
    )
