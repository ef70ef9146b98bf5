"""2018 eq. (16)-(20): from the leaning body's frame to the road's, held against what the simulated machine does.

True: the tyres' lateral forces over the mass, the rate about the road's normal, roll and its rate. Sensors are ideal where nothing
else is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.models.motorcycle import motorcycle_coefficients
from codriver.models.road_frame import GRAVITY, by_turn
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.compare import SENSORS
from codriver.papers.motorcycle2018.methods import machine
from codriver.papers.motorcycle2018.rides import WORDS, Scene, with_imu
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Curve, Plot, Table
from codriver.signals.signal import Array
from codriver.simulate.motorcycle import nominal_machine

TURNING = 0.5  # m/s^2: below it the sign of a lateral acceleration is not asked for
SHOWN = 10  # ticks from point to point of a chart
DEGREE = np.pi / 180


@dataclass(frozen=True, eq=False)
class Framed:
    """A ride in both frames.

    Attributes:
        time: s.
        true_a, true_W: m/s^2 and rad/s.
        squares_a, squares_W: by (17), (19).
        turn_a, turn_W: by a = v W.
        radicand: of (17).
        same: share of turning ticks in which f_y has the sign of a.
        off: RMS of a by (17), by (17) with the yaw rate's sign, and by a = v W; of W by (19) and by the turn; of phi' by (20),
            of phi by (18).
    """

    time: Array
    true_a: Array
    true_W: Array
    squares_a: Array
    squares_W: Array
    turn_a: Array
    turn_W: Array
    radicand: Array
    same: float
    off: dict[str, float]


def framed(ride: Scene, **sensors: float) -> Framed:
    """Both ways on a ride.

    Args:
        ride: the ride.
        sensors: see `Scene.log`.
    """
    log = ride.log(1, **sensors)
    p, q, r, f_y, f_z, v = (
        log[name].values for name in ("roll_rate", "pitch_rate", "yaw_rate", "lateral_acceleration", "vertical_acceleration",
                                      "longitudinal_speed")
    )  # fmt: skip
    t = ride.truth
    a = (t["front_lateral_force"].values + t["rear_lateral_force"].values) / machine().mass
    W, phi, rate = (t[name].values for name in ("heading_rate", "roll_angle", "roll_rate"))
    radicand = f_y**2 + f_z**2 - GRAVITY**2
    squares_a, squares_W = np.sign(f_y) * np.sqrt(np.maximum(radicand, 0.0)), np.sign(r) * np.hypot(q, r)
    turned = [by_turn(float(x), float(y)) for x, y in zip(v, r, strict=True)]
    turn_a, turn_W = np.array([x[0] for x in turned]), np.array([x[1] for x in turned])
    lean = np.arctan2(q * np.sign(r), np.abs(r))
    turning = np.abs(a) > TURNING
    off = {
        "a signed": np.sign(r) * np.abs(squares_a) - a, "a squares": squares_a - a, "a turn": turn_a - a,
        "W squares": squares_W - W, "W turn": turn_W - W,
        "rate": p - rate, "lean": (lean - phi)[turning] / DEGREE, "a": a, "W": W,
    }  # fmt: skip
    return Framed(
        log["yaw_rate"].time, a, W, squares_a, squares_W, turn_a, turn_W, radicand,
        float(np.mean(np.sign(f_y) == np.sign(a), where=turning)),
        {name: float(np.sqrt(np.mean(values**2))) for name, values in off.items()},
    )  # fmt: skip


def frames_chapter(rides: Sequence[Scene]) -> Chapter:
    """What holds of (16)-(20).

    Args:
        rides: one a scenario.
    """
    ideal = {ride.name: framed(ride) for ride in rides}
    noisy = {ride.name: framed(ride, **SENSORS["noise"]) for ride in rides}
    same = {name: f.same for name, f in ideal.items()}
    centre = _mass_centre()
    central = framed(with_imu(rides[-1], centre))
    negative = {name: float(np.mean(f.radicand < 0)) for name, f in ideal.items()}
    worse = {name: f.off["a squares"] / f.off["a turn"] for name, f in ideal.items()}
    wide = {name: f.off["W squares"] / f.off["W"] for name, f in ideal.items()}
    rate, lean = (max(f.off[key] for f in ideal.values()) for key in ("rate", "lean"))
    items = (
        Item("IV.A: both lateral accelerations systematically have the same sign", "systematically", _listed(same, ".0%"), "",
             min(same.values()) >= 0.95,
             f"share of ticks with more than {TURNING:g} m/s² along the road, ideal sensors; 95 % counts. In a balanced turn "
             "gravity and turn cancel along the body's y, and wide tyres let gravity win: the sign is then the wrong one"),
        Item("(17): the lateral acceleration by squares", "considered as measured",
             _listed({n: f.off["a squares"] for n, f in ideal.items()}, ".2f") + " m/s²", "",
             max(f.off["a squares"] / f.off["a"] for f in ideal.values()) <= 0.2,
             "RMS error, ideal sensors; a fifth of the acceleration's rms counts, which is "
             f"{_listed({n: f.off['a'] for n, f in ideal.items()}, '.2f')}. a = v W errs by "
             f"{_listed({n: f.off['a turn'] for n, f in ideal.items()}, '.2f')}, (17) with the yaw rate's sign by "
             f"{_listed({n: f.off['a signed'] for n, f in ideal.items()}, '.2f')}"),
        Item("(17) with the IMU at the mass centre", "as close as possible", f"same sign {central.same:.0%}, "
        f"{central.off['a squares']:.2f} m/s²",
             "", central.off["a squares"] <= 0.2 * central.off["a"],
             f"{WORDS[rides[-1].name]}, ideal sensors, IMU {centre[2]:.2f} m above the road in place of "
             f"{nominal_machine().imu[2]:.2f}: the sign hangs on how high it is, since what it takes to lean depends on that"),
        Item("(17): the root's argument is often negative", None, _listed(negative, ".0%"), "", min(negative.values()) > 0.1,
             "not in the paper; share of ticks with f_y² + f_z² < g², ideal sensors: heave and pitch, which (16) leaves out, "
             "and a falling or rising body. More than a tenth in each ride counts"),
        Item("(19): the yaw rate by squares", "considered as measured", _listed(wide, ".1%"), "", max(wide.values()) <= 0.05,
             "RMS error over the rate's rms, ideal sensors; 5 % counts. With r / cos phi of a balanced turn "
             f"{_listed({n: f.off['W turn'] / f.off['W'] for n, f in ideal.items()}, '.1%')}; with noise "
             f"{_listed({n: f.off['W squares'] / f.off['W'] for n, f in noisy.items()}, '.1%')} and "
             f"{_listed({n: f.off['W turn'] / f.off['W'] for n, f in noisy.items()}, '.1%')}"),
        Item("(20): the roll rate is the gyroscope's", "trivial", rate, "rad/s", rate <= 0.02,
             "greatest RMS error of the rides, ideal sensors; 0.02 counts"),
        Item("(18) with no pitch rate is a poor roll", None, lean, "deg", lean > 2.0,
             "not in the paper, though it follows: phi = atan2(q, r). Greatest RMS error, where it turns, ideal sensors; more "
             f"than 2 deg counts. With noise {max(f.off['lean'] for f in noisy.values()):.1f}"),
        Item("a = v W is nearer than (17)", None, _listed(worse, ".1f"), "", min(worse.values()) > 1,
             "not in the paper; RMS error of (17) over that of a = v W, ideal sensors"),
    )  # fmt: skip
    words = (
        "The model is told of motion along the road, the sensors lean. The paper squares away the unknown roll. What stands in "
        "for that here: in a balanced turn a = v W and sin phi = -v r / g, without root and sign.",
    )
    return Chapter(
        "From the body's frame to the road's (16)-(20)", words,
        (*(_chart(r, ideal[r.name]) for r in rides[:1]), _table(ideal, noisy)), items,
    )  # fmt: skip


def _mass_centre() -> tuple[float, float, float]:
    """Of both frames, from the road point below the rear frame's."""
    q = motorcycle_coefficients(machine())
    return q["m34"] / q["m33"], 0.0, q["m35"] / q["m33"]


def _listed(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{WORDS[name]} {format(value, form)}" for name, value in values.items())


def _table(ideal: dict[str, Framed], noisy: dict[str, Framed]) -> Table:
    rows = tuple(
        (WORDS[name], kind, f.off["a"], f.off["a squares"], f.off["a signed"], f.off["a turn"], f.off["W"],
         f.off["W squares"], f.off["W turn"],
         f.off["lean"])
        for kind, found in (("ideal", ideal), ("noisy", noisy)) for name, f in found.items()
    )  # fmt: skip
    head = ("ride", "sensors", "a, rms, m/s²", "error by (17)", "with the sign of r", "by a = v W", "W, rms, rad/s", "error by "
    "(19)",
            "by the turn", "roll by atan2(q, r), deg")  # fmt: skip
    return Table(head, rows, "RMS over the ride.")


def _chart(ride: Scene, f: Framed) -> Chart:
    few = slice(None, None, SHOWN)
    return Chart(
        f"Lateral acceleration along the road, {WORDS[ride.name]}, ideal sensors", "time (s)",
        (Plot("m/s²", (
            Curve("(17)", f.time[few], f.squares_a[few], "#C84C00"), Curve("a = v W", f.time[few], f.turn_a[few], "#0072B2"),
            Curve("true", f.time[few], f.true_a[few], BLACK, dash="dot"),
        ), 260),),
        "(17) has the size, and the sign only by chance.",
    )  # fmt: skip
