"""Brake regeneration on a real drive: what the car does against what the driver asks for.

An electric car brakes with its motor when the brake pedal is pressed. The motor's torque then differs from the torque
that the accelerator pedal requests, and the car's own jerk jumps by what the powertrain adds. `intent-torque` takes that
part, u = tau/M (T_e - T_r), as a known input, so it does not appear in the intentional jerk; the friction brake, which
the driver presses and no signal gives, does.

    python examples/zoe_regeneration.py FOLDER [PNG]

FOLDER holds one scene of nuScenes' CAN bus expansion, driven by the Renault Zoe.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import codriver as cd
from codriver.errors import CodriverError, LogError

DIFFERENT = 0.15  # m/s^2: |u| above which the actual torque counts as differing from the request
AROUND = 0.5  # s before and after that stretch in which the observers' jerk still shows it
TICK = 0.01


@dataclass(frozen=True)
class Comparison:
    """The kinematic and the intentional jerk where the torque differs from the request.

    Attributes:
        start, stop: the longest such stretch, s from the first tick.
        kinematic_onset, intentional_onset: largest absolute jerk in its first half, m/s^3.
        kinematic_release, intentional_release: the same in its second half.
        kinematic_rms, intentional_rms: over the stretch and `AROUND` s on both sides.
        kinematic_elsewhere, intentional_elsewhere: rms over the rest of the valid time.
    """

    start: float
    stop: float
    kinematic_onset: float
    intentional_onset: float
    kinematic_release: float
    intentional_release: float
    kinematic_rms: float
    intentional_rms: float
    kinematic_elsewhere: float
    intentional_elsewhere: float


def estimate(folder: str | Path, ell: float = 2.0) -> tuple[cd.Estimate, cd.Estimate]:
    """The intentional and the kinematic estimate of the drive, on the same ticks."""
    log = cd.read(folder)
    car = cd.load_vehicle("renault-zoe")
    intent = cd.compile(cd.build("intent-torque", car, dt=TICK, ell=ell)).run(log)
    kinematic = cd.compile(cd.build("kinematic", dt=TICK, ell=ell)).run(log)
    return intent, kinematic


def compare(intent: cd.Estimate, kinematic: cd.Estimate) -> Comparison:
    """Both jerks around the longest stretch in which the torque differs from the request."""
    time = intent.time - intent.time[0]
    start, stop = _longest(np.abs(intent["known_input"].values) > DIFFERENT, time)
    middle = (start + stop) / 2
    jerks = kinematic["longitudinal_jerk"].values, intent["intentional_jerk"].values
    within = (time >= start - AROUND) & (time <= stop + AROUND)
    parts = {
        "onset": within & (time < middle),
        "release": within & (time >= middle),
    }
    onset, release = ([float(np.abs(jerk[part]).max()) for jerk in jerks] for part in parts.values())
    rms = [float(np.sqrt(np.mean(jerk[within] ** 2))) for jerk in jerks]
    rest = ~within & intent.valid & kinematic.valid
    elsewhere = [float(np.sqrt(np.mean(jerk[rest] ** 2))) for jerk in jerks]
    return Comparison(start, stop, *onset, *release, *rms, *elsewhere)


def _longest(mask: np.ndarray, time: np.ndarray) -> tuple[float, float]:
    """First and last time of the longest stretch where a mask holds; gaps of less than 0.2 s do not end it."""
    here = time[mask]
    if not here.size:
        raise LogError("the torque never differs from the request", "a drive with regeneration", "take another scene")
    groups = np.split(here, np.flatnonzero(np.diff(here) > 0.2) + 1)
    longest = max(groups, key=lambda group: group[-1] - group[0])
    return float(longest[0]), float(longest[-1])


def draw(intent: cd.Estimate, kinematic: cd.Estimate, found: Comparison, path: str | Path) -> None:
    """The comparison as a picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    time = intent.time - intent.time[0]
    given = intent.grid.values
    pressed = np.nan_to_num(given["brake_switch"]) > 0.5
    figure, axes = plt.subplots(
        4, 1, sharex=True, figsize=(10, 11), height_ratios=(1, 1.2, 1.2, 1.6), layout="constrained"
    )
    figure.suptitle(
        "Renault Zoe in a city, braking with the motor: the regeneration is in the car's jerk and not in the intended one.\n"
        "What is left in the intended jerk: the released accelerator, and the friction brake that the driver presses",
        fontsize=11,
    )

    axes[0].plot(time, given["longitudinal_speed"] * 3.6, color="black", lw=1.5)
    axes[0].set_ylabel("speed\nkm/h")
    axes[0].set_ylim(bottom=0)

    axes[1].plot(time, given["engine_torque"], color="tab:red", lw=1.5, label="actual torque of the motor")
    axes[1].plot(time, given["engine_torque_request"], color="tab:blue", lw=1.5, label="torque requested by the pedal")
    axes[1].fill_between(
        time, given["engine_torque"], given["engine_torque_request"], color="tab:red", alpha=0.15, lw=0,
        label="what the driver did not ask for by the pedal",
    )  # fmt: skip
    axes[1].set_ylabel("torque\nN m")

    axes[2].plot(
        time, kinematic["longitudinal_acceleration"].values, color="tab:red", lw=1.5, label="of the car (kinematic)"
    )
    axes[2].plot(
        time, intent["intentional_acceleration"].values, color="tab:blue", lw=1.5, label="intended (intent-torque)"
    )
    axes[2].plot(
        time, intent["known_input"].values, color="grey", lw=1, ls="--", label="known input u = tau/M (T_e − T_r)"
    )
    axes[2].set_ylabel("acceleration\nm/s²")

    jerk, sd = intent["intentional_jerk"].values, intent.sd("intentional_jerk")
    if sd is not None:
        axes[3].fill_between(time, jerk - 1.96 * sd, jerk + 1.96 * sd, color="tab:blue", alpha=0.15, lw=0,
                             label="95 % band of the intended")  # fmt: skip
    axes[3].plot(time, kinematic["longitudinal_jerk"].values, color="tab:red", lw=1.5,
                 label=f"of the car: rms {found.kinematic_rms:.2f} m/s³ between the dotted lines")  # fmt: skip
    axes[3].plot(time, jerk, color="tab:blue", lw=1.5,
                 label=f"intended: rms {found.intentional_rms:.2f} m/s³ between the dotted lines")  # fmt: skip
    for when, car, driver, height in (
        ((found.start + found.stop) / 2 - 0.9, found.kinematic_onset, found.intentional_onset, -3.3),
        (found.stop - 0.3, found.kinematic_release, found.intentional_release, 2.9),
    ):
        axes[3].text(when, height, f"peak {car:.2f}, intended {driver:.2f}", ha="center", fontsize=9)
    axes[3].set_ylim(-3.9, 4.9)
    axes[3].set_ylabel("jerk\nm/s³")
    axes[3].set_xlabel("time from the start of the scene, s")

    for axis in axes:
        axis.fill_between(time, 0, 1, where=pressed, transform=axis.get_xaxis_transform(), color="orange", alpha=0.15, lw=0,
                          label="brake pedal pressed" if axis is axes[0] else None)  # fmt: skip
        for edge in (found.start - AROUND, found.stop + AROUND):
            axis.axvline(edge, color="black", lw=0.8, ls=":")
        axis.axhline(0, color="black", lw=0.5)
        axis.grid(alpha=0.25)
        axis.set_xlim(time[0], time[-1])
        low = axis in (axes[0], axes[1], axes[2])  # where the curves leave room
        axis.legend(loc="lower right" if low else "upper right", fontsize=9, framealpha=0.9)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def describe(found: Comparison) -> str:
    """The numbers as a table."""
    rows = [
        ("largest at the onset", found.kinematic_onset, found.intentional_onset),
        ("largest at the release", found.kinematic_release, found.intentional_release),
        (f"rms, with {AROUND:g} s on both sides", found.kinematic_rms, found.intentional_rms),
        ("rms in the rest of the drive", found.kinematic_elsewhere, found.intentional_elsewhere),
    ]
    head = f"the torque differs from the request by more than {DIFFERENT:g} m/s^2 from {found.start:.2f} to {found.stop:.2f} s"
    lines = [f"{head}\n", f"{'jerk, m/s^3':<32}{'of the car':>12}{'intended':>12}{'less by':>10}"]
    lines += [f"{what:<32}{car:>12.2f}{driver:>12.2f}{1 - driver / car:>10.0%}" for what, car, driver in rows]
    return "\n".join(lines)


def main() -> None:
    """Print the numbers and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="one scene of nuScenes' CAN bus expansion")
    parser.add_argument("png", nargs="?", default="zoe_regeneration.png", help="picture to write")
    parser.add_argument("--ell", type=float, default=2.0, help="the knob (default 2)")
    given = parser.parse_args()
    try:
        intent, kinematic = estimate(given.folder, given.ell)
        found = compare(intent, kinematic)
    except CodriverError as error:
        raise SystemExit(str(error)) from None
    print(describe(found))
    draw(intent, kinematic, found, given.png)
    print(f"\nwrote {given.png}")


if __name__ == "__main__":
    main()
