"""Figures of alignment.md: python docs/measure/alignment.py FOLDER, with the recordings of udacity-lincoln-mkz."""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

import codriver as cd
from codriver.identify.alignment_drive import Drive, alignment_drive
from codriver.identify.alignment_fit import LETTERS, Chosen, correlation_time, fit_map, fit_told, modelled
from codriver.identify.alignment_holdout import features, regression
from codriver.models.alignment import AlignmentModel
from codriver.models.single_track import SLOWEST, SingleTrack
from codriver.signals.signal import Array

FILES = {"hmb1": "hmb1-20hz.csv", "hmb2": "hmb2-20hz.csv", "hmb6": "hmb6-steering-50hz.csv"}
NAMES = Path(__file__).parents[2] / "tests" / "names" / "udacity.toml"
# Lincoln MKZ: ratio and wheelbase as its drive-by-wire kit has them
START = AlignmentModel(1.0, steering_ratio=14.8, wheelbase=2.85)
ALL = tuple(LETTERS)
Way = Callable[[Chosen], Callable[[Drive], Array]]


def fitted(rows: Chosen) -> Callable[[Drive], Array]:
    """As the command does it."""
    model = fit_told(rows, START)[0].model
    return lambda drive: modelled(drive, model)


def with_letters(start: AlignmentModel, without: tuple[str, ...] = ()) -> Way:
    """Some letters held."""

    def way(rows: Chosen) -> Callable[[Drive], Array]:
        model = fit_map(rows, start, [letter for letter in ALL if letter not in without]).model
        return lambda drive: modelled(drive, model)

    return way


def with_zero(rows: Chosen) -> Callable[[Drive], Array]:
    """A zero error of the angle, the one from -1 to 1 degree with the least error."""

    def moved(drive: Drive, zero: float) -> Drive:
        return replace(drive, lateral=drive.speed**2 * START.curvature(drive.angle - zero, drive.speed))

    tried = [
        (fit_map([(moved(d, zero), keep) for d, keep in rows], START), zero)
        for zero in np.radians(np.arange(-1, 1.1, 0.25))
    ]
    fit, zero = min(tried, key=lambda one: one[0].sd)
    return lambda drive: modelled(moved(drive, zero), fit.model)


def nine(rows: Chosen) -> Callable[[Drive], Array]:
    """The regression."""
    theta = regression(rows)
    return lambda drive: features(drive) @ theta


def mean(rows: Chosen) -> Callable[[Drive], Array]:
    """The mean."""
    middle = float(np.mean(np.concatenate([d.torque[keep] for d, keep in rows])))
    return lambda drive: np.full(drive.time.size, middle)


WAYS: dict[str, Way] = {
    "map": fitted,
    "map, level roads": with_letters(replace(START, bank=0.0), ("e_max", "q")),
    "map, no bend": with_letters(replace(START, bend=1e9), ("T_s",)),
    "map, friction by sign alone": with_letters(replace(START, width=1e-5), ("w",)),
    "map, no friction": with_letters(START, ("T_c",)),
    "map, zero of the angle fitted": with_zero,
    "regression of nine features": nine,
    "mean": mean,
}


def at_the_moment(drive: Drive) -> Drive:
    """Roads made for the speed of the moment."""
    return replace(drive, road_speed=np.maximum(drive.speed, 1.0))


def all_alike(drive: Drive) -> Drive:
    """Roads made for 20 m/s, all of them."""
    return replace(drive, road_speed=np.full(drive.time.size, 20.0))


def moving(drive: Drive) -> Drive:
    """The front axle's lateral acceleration by a single track that moves; a usual car of this size, same characteristic speed."""
    front, rear = 1.33, 1.52
    stiff = 1.5e5
    soft = rear * stiff / (front + START.wheelbase**2 * stiff / 1850 / START.characteristic_speed**2)
    track = SingleTrack(1850.0, 3300.0, front, rear, soft, stiff)
    x, force = (0.0, 0.0), np.empty(drive.time.size)
    for k, (a, v) in enumerate(zip(drive.angle / START.steering_ratio, np.maximum(drive.speed, SLOWEST), strict=True)):
        x = track.advance(*x, a, v, drive.dt)
        force[k] = track.front_stiffness * track.front_slip(*x, a, v) / track.front_mass
    return replace(drive, lateral=force)


def earlier(drive: Drive) -> Drive:
    """The angle 40 ms earlier, as no causal estimate has it."""
    names = ("angle", "rate", "lateral", "road_curvature")
    return replace(drive, **{n: np.interp(drive.time + 0.04, drive.time, getattr(drive, n)) for n in names})


def told(y: Array, x: Array) -> str:
    """RMSE and R2."""
    e = y - x
    return f"{np.sqrt(np.mean(e**2)):.3f}, {1 - np.mean(e**2) / np.var(y):.3f}"


def on(drives: dict[str, Drive], fit_on: str, test: str, way: Way) -> str:
    """Fitted on some drives, tried on one."""
    answer = way([(drives[name], drives[name].keep) for name in fit_on.split()])
    drive = drives[test]
    return told(drive.torque[drive.keep], answer(drive)[drive.keep])


def by_blocks(drives: dict[str, Drive], names: str, way: Way, seconds: float = 60.0, gap: float = 5.0) -> str:
    """Each block of 60 s left out in turn with 5 s on both sides; the rest of all drives fits."""
    y, x = [], []
    for name in names.split():
        drive = drives[name]
        others = [(drives[n], drives[n].keep) for n in names.split() if n != name]
        clock = drive.time - drive.time[0]
        for start in np.arange(0.0, clock[-1] - seconds / 2, seconds):
            inside = (clock >= start) & (clock < start + seconds) & drive.keep
            rest = ((clock < start - gap) | (clock >= start + seconds + gap)) & drive.keep
            answer = way([*others, (drive, rest)])
            y.append(drive.torque[inside])
            x.append(answer(drive)[inside])
    return told(np.concatenate(y), np.concatenate(x))


def main(folder: Path) -> None:
    """All tables."""
    drives = {n: alignment_drive(cd.read(folder / file, names=NAMES), START) for n, file in FILES.items()}
    print("| fitted on |", " | ".join(f"{letter} ({LETTERS[letter][3]})" for letter in ALL), "|")
    for names in ("hmb1 hmb2", "hmb1", "hmb2", "hmb6", "hmb1 hmb2 hmb6"):
        fit, _ = fit_told([(drives[n], drives[n].keep) for n in names.split()], START)
        cells = []
        for letter in ALL:
            if letter not in fit.free:
                cells.append("not told")
                continue
            value, sd = getattr(fit.model, LETTERS[letter][0]), float(fit.sd_x[fit.free.index(letter)])
            cells.append(f"{value:.3g} ± {sd if letter == 'T_0' else value * sd:.2g}")
        print(f"| {names} |", " | ".join(cells), "|")
    trials = (("hmb1 hmb2", "hmb6"), ("hmb1", "hmb2"), ("hmb2", "hmb1"), ("hmb1 hmb6", "hmb2"), ("hmb2 hmb6", "hmb1"))
    print("\n| RMSE in N m, R2 |", " | ".join(f"{a} to {b}" for a, b in trials), "| blocks of hmb1, hmb2 |")
    for name, way in WAYS.items():
        cells = [on(drives, a, b, way) for a, b in trials]
        print(f"| {name} |", " | ".join(cells), "|", by_blocks(drives, "hmb1 hmb2", way), "|")
    others = {
        "map, roads made for the speed of the moment": at_the_moment,
        "map, all roads made for one speed": all_alike,
        "map, slip of a moving single track": moving,
        "map, angle 40 ms earlier": earlier,
    }
    for name, changed in others.items():
        new = {n: changed(d) for n, d in drives.items()}
        cells = [on(new, a, b, fitted) for a, b in trials]
        print(f"| {name} |", " | ".join(cells), "|", by_blocks(new, "hmb1 hmb2", fitted), "|")
    print("\nerror on hmb6 by speed, fitted on hmb1 and hmb2")
    rows = [(drives[n], drives[n].keep) for n in ("hmb1", "hmb2")]
    drive, answer = drives["hmb6"], fitted(rows)
    e = drive.torque - answer(drive)
    for low, high in ((1, 5), (5, 10), (10, 20), (20, 40)):
        part = drive.keep & (drive.speed >= low) & (drive.speed < high)
        print(f"| {low} to {high} m/s | {part.sum() * drive.dt:.0f} s | {e[part].mean():+.3f} | {e[part].std():.3f} |")
    print(f"correlation time {correlation_time([(drive, drive.keep)], [e]):.1f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
