"""2018 section V.D: tables II and III, and what is said of them."""

from __future__ import annotations

from codriver.errors import DesignError
from codriver.models.motorcycle import motorcycle_model
from codriver.observers.motorcycle_uio import design_motorcycle_uio
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.compare import Compared, legend
from codriver.papers.motorcycle2018.methods import METHODS, RANGE, machine
from codriver.papers.motorcycle2018.rides import DT, NOISE, RATE, SETTLE, WORDS
from codriver.papers.reproduction import Chapter
from codriver.report.document import Table

# Table III: ideal and real sensors, degrees.
PAPER = {"track": (0.79, 0.84), "slalom": (1.09, 1.53), "double-lane-change": (1.08, 1.55)}
KINDS = ("ideal", "noise")
# Table II: what it has of others, degrees.
IMU, UIO = 2.01, (1.28, 1.85)
ALIKE = 1.25


def tables_chapter(found: Compared) -> Chapter:
    """Tables II and III, every observer.

    Args:
        found: judged.
    """
    leans = ", ".join(f"{WORDS[ride]} {z['roll_angle']:.0f}" for ride, z in found.zero.items())
    words = (
        "Our rides are not the paper's, of which no figures are printed, and our machine is not BikeSim's: numbers can agree "
        f"in size, not in digits. Ours lean by {leans} deg rms. Noise is {NOISE:.1%} of each signal's rms at {RATE} Hz on "
        "gyroscope and accelerometer, and an encoder of 4096 counts; biases are 0.5 deg/s and 0.2 m/s². Errors count from "
        f"{SETTLE:g} s on.",
        "The paper's observer stands first, behind (17) and (19); then the same given the measurements of (21) themselves, as "
        "a simulator can but no sensor does: noise is then 7.5 % of each one's largest value. In the rows below a = v W takes "
        "the place of (17). “Shipped” was chosen with these rides at hand, which flatters it.",
    )
    names = ("roll_angle", "rider_torque", "front_lateral_force", "rear_lateral_force", "lateral_velocity")
    items = (*_third(found), *_second(found), *_said(found), *_beside(found))
    return Chapter(
        "Tables II and III: the errors (V.D)",
        words,
        (_against(found), legend(), *(found.table(name) for name in names)),
        items,
    )


def in_short(found: Compared) -> str:
    """The roll's errors with noise, in a sentence.

    Args:
        found: judged.
    """

    def told(method: str) -> str:
        return ", ".join(f"{found.roll(method, ride, 'noise'):.2f}" for ride in found.zero)

    rides, paper = ", ".join(WORDS[r] for r in found.zero), ", ".join(f"{PAPER[r][1]:.2f}" for r in found.zero)
    return (
        f"With noise ({rides}) the paper's roll errs by {paper} degrees. Ours errs by {told('fed')} where the observer is given "
        f"yaw rate and acceleration along the road as they are, as a simulator can; by {told('paper')} where these are made of "
        f"what gyroscope and accelerometer show, by (17)-(20); by {told('signed')} with the yaw rate's sign in (17); by "
        f"{told('ts')} with a = v W in its place; and an extended Kalman filter on the raw signals by {told('ekf')}."
    )


def _against(found: Compared) -> Table:
    """Table III beside ours."""
    shown = ("fed", "paper", "signed", "ts", "shipped", "kalman", "ekf")
    rows = [
        (WORDS[ride], "ideal" if k == 0 else "real", PAPER[ride][k], *(found.roll(m, ride, kind) for m in shown))
        for ride in found.zero for k, kind in enumerate(KINDS)
    ]  # fmt: skip
    return Table(
        ("scenario", "sensors", "table III", *(METHODS[m].short for m in shown)), tuple(rows),
        "Table III beside ours: RMSE of the roll angle, degrees.",
    )  # fmt: skip


def _third(found: Compared) -> tuple[Item, ...]:
    made = []
    for ride in found.zero:
        for k, kind in enumerate(KINDS):
            limit, where = ALIKE * PAPER[ride][k], f"{WORDS[ride]}, {'ideal' if k == 0 else 'real'} sensors"
            fed, value = found.roll("fed", ride, kind), found.roll("paper", ride, kind)
            made += [
                Item(f"table III: roll, {where}, measurements of (21) as they are", PAPER[ride][k], fed, "deg", fed <= limit,
                     "the LMI observer given true yaw and steer rate and acceleration along the road, "
                     f"{'with' if k else 'without'} noise on each; at most {ALIKE:g} times the paper's figure counts"),
                Item(f"table III: roll, {where}, from what sensors show by (17)-(20)", PAPER[ride][k], value, "deg", value <= limit,
                     f"the same observer behind (17) and (19); at most {ALIKE:g} times the paper's figure counts. With the yaw "
                     f"rate's sign in (17) {found.roll('signed', ride, kind):.2f}, with a = v W "
                     f"{found.roll('ts', ride, kind):.2f}, shipped {found.roll('shipped', ride, kind):.2f}, answering zero "
                     f"{found.zero[ride]['roll_angle']:.1f}"),
            ]  # fmt: skip
    return tuple(made)


def _second(found: Compared) -> tuple[Item, ...]:
    if "track" not in found.zero:
        return ()
    imu, plain = found.roll("imu", "track", "noise"), found.roll("imu-plain", "track", "noise")
    uio = [found.roll("uio-fed", "track", kind) for kind in KINDS]
    made = [
        Item("table II: vision system, and mean of vision and IMU", "2.24 and 1.20 deg", "no camera here", "", None, "of [26]"),
        Item("table II: IMU with a Kalman filter", IMU, plain, "deg", plain <= ALIKE * IMU,
             f"of [26], on another track; ours is a point mass on thin tyres, and {imu:.2f} with the tyres' width: what wide "
             f"tyres take and what large leans add nearly cancel. At most {ALIKE:g} times counts"),
    ]  # fmt: skip
    for k, (paper, ours) in enumerate(zip(UIO, uio, strict=True)):
        made.append(Item(
            f"table II: unknown-input observer, {'ideal' if k == 0 else 'realistic'} sensors", paper, ours, "deg",
            ours <= ALIKE * paper,
            "of [25], whose model is nonlinear in roll and steer; ours is linear. Given the measurements of (21) themselves; "
            f"from sensors with a = v W {found.roll('uio', 'track', KINDS[k]):.2f}. At most {ALIKE:g} times counts",
        ))  # fmt: skip
    made.append(_existence())
    return tuple(made)


def _said(found: Compared) -> tuple[Item, ...]:
    """What V.D says in words."""
    made = []
    if "track" in found.zero:
        for name, told in (("ideal", 0.38), ("noise", 0.54)):
            gain = 1 - found.roll("fed", "track", name) / found.roll("uio-fed", "track", name)
            made.append(Item(
                f"V.D: better than the UIO, {'ideal' if name == 'ideal' else 'noisy'} sensors", told, gain, "1", gain >= told / 2,
                "1 less the LMI observer's RMSE over the UIO's, both given the measurements of (21), track; half the paper's "
                "gain counts. From sensors, both with a = v W, "
                f"{1 - found.roll('ts', 'track', name) / found.roll('uio', 'track', name):.2f}",
            ))  # fmt: skip
        harder = all(
            found.roll("ts", ride, "noise") > found.roll("ts", "track", "noise")
            for ride in found.zero
            if ride != "track"
        )
        made.append(Item(
            "V.D: slalom and lane change are harder than the track", "poorer RMSE",
            ", ".join(f"{WORDS[ride]} {found.roll('ts', ride, 'noise'):.2f}" for ride in found.zero) + " deg", "", harder,
            "LMI with a = v W, noisy sensors. What is hard here is a large lean, since the model is linear: "
            + ", ".join(f"{WORDS[r]} {z['roll_angle']:.0f}" for r, z in found.zero.items()) + " deg rms",
        ))  # fmt: skip
    ratios = {ride: found.roll("fed", ride, "noise") / found.roll("fed", ride, "ideal") for ride in found.zero}
    own = {ride: b / a for ride, (a, b) in PAPER.items()}
    made.append(Item(
        "V.D: the roll is almost insensitive to noise", "small variations",
        ", ".join(f"{WORDS[ride]} {r:.2f}" for ride, r in ratios.items()), "", max(ratios.values()) <= 1.2,
        "RMSE with noise over that without, given the measurements of (21); at most 1.2 counts. Table III itself has "
        + ", ".join(f"{r:.2f}" for r in own.values()),
    ))  # fmt: skip
    return tuple(made)


def _beside(found: Compared) -> tuple[Item, ...]:
    """Goals of our own."""
    made = []
    for ride in found.zero:
        best, paper = found.best(ride, "noise"), PAPER[ride][1]
        value = found.roll(best, ride, "noise")
        made.append(Item(
            f"the best observer, {WORDS[ride]}, noisy sensors", None, value, "deg", value < paper,
            f"not in the paper; {METHODS[best].label}. Below the paper's {paper:g} counts; with biases "
            f"{found.roll(best, ride, 'bias'):.2f}",
        ))  # fmt: skip
    worst = max(found.roll("signed", ride, "noise") for ride in found.zero)
    made.append(Item(
        "(17) is mended by the yaw rate's sign", None,
        ", ".join(f"{WORDS[r]} {found.roll('signed', r, 'noise'):.2f}" for r in found.zero) + " deg", "", worst <= 2.0,
        "not in the paper; sign(r) in place of sign(f_y), the rest of its observer as it is, noisy sensors. 2 deg in each ride "
        "counts; the paper has " + ", ".join(f"{PAPER[r][1]:.2f}" for r in found.zero),
    ))  # fmt: skip
    for ride in found.zero:
        value = found.roll("shipped", ride, "noise")
        made.append(Item(
            f"the LMI observer can reach table III, {WORDS[ride]}", None, value, "deg", value <= PAPER[ride][1],
            f"not in the paper; slower poles, a = v W, noisy sensors; at most the paper's {PAPER[ride][1]:g} counts",
        ))  # fmt: skip
    torque = {
        ride: found.errors["ekf", ride, "noise"]["rider_torque"] / z["rider_torque"] for ride, z in found.zero.items()
    }
    lmi = {
        ride: found.errors["ts", ride, "noise"]["rider_torque"] / z["rider_torque"] for ride, z in found.zero.items()
    }
    made.append(Item(
        "the rider's torque is known to a quarter of its rms", None,
        "EKF " + ", ".join(f"{r:.2f}" for r in torque.values()) + "; LMI " + ", ".join(f"{r:.2f}" for r in lmi.values()), "",
        max(torque.values()) <= 0.25,
        "not in the paper, which gives no figure of the torque; RMSE over the torque's rms, noisy sensors, "
        + ", ".join(WORDS[r] for r in torque) + ". The EKF is judged",
    ))  # fmt: skip
    return tuple(made)


def _existence() -> Item:
    """From which measurements of (21) an unknown-input observer can be made."""
    model = motorcycle_model(machine())
    rows = dict(zip(model.outputs, model.C, strict=True))
    sets = {
        "all five": tuple(rows), "no steering rate": tuple(n for n in rows if n != "steer_rate"),
        "angle and acceleration": ("steer_angle", "lateral_acceleration"),
    }  # fmt: skip
    there = {}
    for name, chosen in sets.items():
        try:
            design_motorcycle_uio(model.with_outputs({n: rows[n] for n in chosen}), *RANGE, DT)
            there[name] = "exists"
        except DesignError:
            there[name] = "refused"
    return Item(
        "an unknown-input observer exists for (21)", None, ", ".join(f"{name}: {said}" for name, said in there.items()), "",
        there["all five"] == "exists",
        "not in the paper; the torque must show in the first derivative of what is measured, at each speed, and no zero may be "
        "unstable",
    )  # fmt: skip
