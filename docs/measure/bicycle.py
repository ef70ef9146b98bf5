"""Figures of bicycle.md: python docs/measure/bicycle.py. Needs the recordings in ../shared/data."""

# ruff: noqa: T201
from __future__ import annotations

from pathlib import Path

import numpy as np

import codriver as cd
from codriver.errors import LogError
from codriver.identify import SteerRecord, SteerRowFit, fit_steer_row, steer_record
from codriver.models import BicycleMatrices, BicycleParameters, SteerRow, bicycle_matrices, bicycle_model
from codriver.observers.disturbance import disturbance_observer
from codriver.observers.disturbance_design import design_disturbance_filter

ROOT = Path(__file__).parent.parent.parent
DATA = ROOT.parent / "shared" / "data"
NAMES = ROOT / "tests" / "names"
RUNS = {
    "1.2 Hz": "bode_normal_4mps_1.2Hz", "1.6 Hz": "bode_normal_4mps_1.6Hz", "2.4 Hz": "bode_normal_4mps_2.4Hz",
    "14.4 km/h": "eigen_normal_sil6.5n2_14.4kph", "9 km/h": "eigen_normal_sil6.5n2_9kph",
}  # fmt: skip
LEARNT = ("1.6 Hz", "2.4 Hz")
SPEED = {"9 km/h": 2.51}  # m/s; the others 4.15
FALLS = 59.0  # s: in the run at 1.2 Hz the bicycle falls at 60 s
SHIFTS = (0, 20, 40, 60)  # ms
# order, torque's random walk, encoder, noise on the steer rate, chosen on the runs learnt from
FILTER = {"unknown_noise": [2.0**2], "output_noise": [1e-3**2], "state_noise": [0.0, 0.5**2], "order": 1}
# K. Pasma, MSc thesis, TU Delft 2024; github.com/mechmotum/sbw_bicycle_with_model_matching
STEER_BY_WIRE = BicycleParameters(
    w=1.036, c=0.0803, lam=np.deg2rad(18.2), rR=0.3498, mR=10.12, IRxx=0.1040, IRyy=0.1641, xB=0.462, zB=-0.698, mB=20.9,
    IBxx=1.64, IBxz=0.654, IBzz=1.94, xH=0.944, zH=-0.595, mH=0.6, IHxx=0.0098, IHxz=-0.00044, IHzz=0.00396, rF=0.3498,
    mF=1.78, IFxx=0.0644, IFyy=0.1289,
)  # fmt: skip
DAVIS = BicycleParameters.from_vehicle(cd.load_vehicle("moore2012"))  # frame and rider
# Moore 2012, tables of chapter 12: identified from 374 runs of three riders; the paper's axes, K2_dphi and K2_pp are 0
MOORE = SteerRow(-2.284, 0.2, 0.888, 1.7337, 3.918, -0.6678, 2.34)
BASES = {
    "angle, rate": ("K2_dd", "C1_dd", "offset"),
    "angle, rate, friction": ("K2_dd", "C1_dd", "friction", "offset"),
    "angle, rate, roll, friction": ("K2_dd", "C1_dd", "K0_dphi", "friction", "offset"),
}


def delft() -> dict[str, cd.Log]:
    """The runs by name, the fall left out."""
    folder = DATA / "tudelft-steer-by-wire-bicycle"
    logs = {run: cd.read(folder / f"{file}.log", names=NAMES / "steer-by-wire.toml") for run, file in RUNS.items()}
    return logs | {"1.2 Hz": logs["1.2 Hz"].between(0.0, FALLS)}


def davis() -> cd.Log:
    """The ride, its gyroscope's mean taken out."""
    log = cd.read(DATA / "davis-instrumented-bicycle" / "run-283-first-60s.csv", names=NAMES / "davis-bicycle.toml")
    rate = log["roll_rate"]
    return log.with_signals(cd.Signal(rate.name, rate.time, rate.values - rate.values.mean(), rate.unit))


def score(found: np.ndarray, truth: np.ndarray) -> str:
    """RMSE, R2 and correlation."""
    error = found - truth
    return f"{np.sqrt(np.mean(error**2)):.3f}, {1 - np.mean(error**2) / truth.var():.3f}, {np.corrcoef(found, truth)[0, 1]:.3f}"


def regression(records: list[SteerRecord], names: tuple[str, ...]) -> np.ndarray:
    """Least squares of the torque on columns."""
    X = np.vstack([columns(r, names)[r.used] for r in records])
    return np.linalg.lstsq(X, np.concatenate([r.torque[r.used] for r in records]), rcond=None)[0]


def columns(record: SteerRecord, names: tuple[str, ...]) -> np.ndarray:
    """Columns of the row's equation, by coefficient."""
    made = record.motion.columns(9.81)
    return np.column_stack([made[name] for name in names])


def ways(
    learnt: list[SteerRecord], judged: SteerRecord, published: dict[str, SteerRow], fits: dict[str, SteerRowFit]
) -> dict[str, str]:
    """The score of each way on one record; of the published rows the mean is taken out, since roll has an offset."""
    u, truth = judged.used, judged.torque[judged.used]
    out = {"zero": score(np.zeros_like(truth) + 1e-9 * np.arange(truth.size), truth).rsplit(",", 1)[0] + ", -"}
    for name, base in BASES.items():
        out[f"regression: {name}"] = score((columns(judged, base) @ regression(learnt, base))[u], truth)
    for name, row in published.items():
        made = row.torque(judged.motion)[u]
        out[name] = score(made - made.mean() + truth.mean(), truth)
    return out | {f"row, fitted by {way}": score(fit.row.torque(judged.motion)[u], truth) for way, fit in fits.items()}


def show(fit: SteerRowFit) -> str:
    """Coefficients with standard errors."""
    return ", ".join(f"{name} {getattr(fit.row, name):.3f} +- {sd:.3f}" for name, sd in fit.sd.items())


def causal(log: cd.Log, row: SteerRow, speed: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """The torque of the Kalman filter with friction added to it, and the known torque; the first 3 s left out."""
    rate = log["roll_rate"]
    acceleration = np.r_[0.0, np.diff(rate.values) / np.diff(rate.time)]
    log = log.with_signals(cd.Signal("roll_acceleration", rate.time, acceleration, "rad/s^2"))
    design = design_disturbance_filter(row.model(speed), ("rider_torque",), dt, **FILTER)
    estimate = cd.compile(disturbance_observer(design, [1.0, 5.0, 10.0])).run(log)
    found = estimate["rider_torque"].values + row.drag(estimate["steer_rate"].values)
    n, skip = min(found.size, log["rider_torque"].values.size), round(3 / dt)
    return found[skip:n], log["rider_torque"].values[skip:n]


def raw(log: cd.Log, names: tuple[str, ...]) -> np.ndarray:
    """The regression's columns from unfiltered signals; the rate is the last difference of the angle."""
    dt = float(np.median(np.diff(log["steer_angle"].time)))
    steer, v = log["steer_angle"].values, log["longitudinal_speed"].values
    rate = np.r_[0.0, np.diff(steer) / dt]
    made = {"K2_dd": v**2 * steer, "C1_dd": v * rate, "K0_dphi": 9.81 * log["roll_angle"].values,
            "friction": np.tanh(rate / 0.05), "offset": np.ones_like(v)}  # fmt: skip
    return np.column_stack([made[name] for name in names])


def shifted(found: np.ndarray, truth: np.ndarray, dt: float) -> str:
    """R2 where the estimate may come so much later."""
    ks = [round(ms / 1000 / dt) for ms in SHIFTS]
    r2 = [1 - np.mean((truth[: truth.size - k] - found[k:]) ** 2) / truth.var() for k in ks]
    return " | ".join(f"{x:.2f}" for x in r2)


def table(rows: dict[str, dict[str, str]]) -> None:
    """Ways down, records across."""
    print("| way | " + " | ".join(rows) + " |\n| --- |" + " --- |" * len(rows))
    for way in next(iter(rows.values())):
        print(f"| {way} | " + " | ".join(r[way] for r in rows.values()) + " |")


def main() -> None:
    """All tables."""
    logs = delft()
    records = {run: steer_record(log, 0.01) for run, log in logs.items()}
    learnt = [records[run] for run in LEARNT]
    own = SteerRow.of(bicycle_matrices(STEER_BY_WIRE).to_iso())
    given = {"K0_dd": own.K0_dd}
    fits = {way: fit_steer_row(learnt, given, by=way) for way in ("acceleration", "torque")}
    print("published", own)
    for way, fit in fits.items():
        print(f"by {way}: R2 {fit.r2:.3f}, {fit.rows} rows: {show(fit)}")
    friction = fits["acceleration"].row.friction
    published = {"published": own, "published, with friction": own.with_values(friction=friction)}
    print("\nRMSE N m, R2, correlation; 5 Hz both ways")
    table({run: ways(learnt, record, published, fits) for run, record in records.items()})

    print("\ndelay of the torque, ms: R2 of the acceleration, M_dd")
    for ms in (-40, -20, -10, 0, 10, 20, 30, 40, 50, 60, 70, 80):
        try:
            fit = fit_steer_row([steer_record(logs[run], 0.01, delay=ms / 1000) for run in LEARNT], given)
            print(f"| {ms} | {fit.r2:.3f} | {fit.row.M_dd:.3f} +- {fit.sd['M_dd']:.3f} |")
        except LogError as error:
            print(f"| {ms} | refused: {error.found} |")
    for run in RUNS:
        try:
            fit = fit_steer_row([records[run]], given)
            print(f"{run} alone: {fit.row.M_dd:.3f} +- {fit.sd['M_dd']:.3f}, {show(fit)}")
        except LogError as error:
            print(f"{run} alone: {error.found}")

    print("\nhand torque where it is not passed to the fork: slope of (row's torque - command) on it")
    for run, file in RUNS.items():
        path = DATA / "tudelft-steer-by-wire-bicycle" / f"{file}.log"
        names = path.open().readline().strip().split(",")
        c = dict(zip(names, np.genfromtxt(path, delimiter=",", skip_header=1).T, strict=True))
        record, n = records[run], records[run].used.size
        passed = np.abs(c["command_fork"] - c["sil_command"])[:n] > 1e-4
        use = record.used & ~passed & (np.abs(c["hand_torque"][:n]) > 0.2)
        left, hand = (fits["torque"].row.torque(record.motion) - record.torque)[use], -c["hand_torque"][:n][use]
        worst = np.abs(c["command_fork"] - c["sil_command"] - c["hand_torque"])[:n][passed].max()
        most, slope = np.abs(c["hand_torque"][:n][~passed]).max(), hand @ left / (hand @ hand)
        print(
            f"{run}: passed in {passed.mean():.3f} of the rows, to within {worst:.1g} N m; else up to {most:.2f}, slope {slope:.2f}"
        )

    print(f"\ncausal, R2 at delays of {SHIFTS} ms")
    base = BASES["angle, rate, roll, friction"]
    theta = np.linalg.lstsq(np.vstack([raw(logs[r], base) for r in LEARNT]),
                            np.concatenate([logs[r]["rider_torque"].values for r in LEARNT]), rcond=None)[0]  # fmt: skip
    for run, log in logs.items():
        for way, fit in fits.items():
            print(
                f"| {run} | filter, row by {way} | {shifted(*causal(log, fit.row, SPEED.get(run, 4.15), 0.01), 0.01)} |"
            )
        print(f"| {run} | filter, published + friction | "
              f"{shifted(*causal(log, published['published, with friction'], SPEED.get(run, 4.15), 0.01), 0.01)} |")  # fmt: skip
        print(
            f"| {run} | regression | {shifted((raw(log, base) @ theta)[300:], log['rider_torque'].values[300:], 0.01)} |"
        )
    ride_of_davis()


def ride_of_davis() -> None:
    """The tables of the Davis bicycle."""
    ride, v = davis(), 4.25
    own = bicycle_matrices(DAVIS).to_iso()
    row = SteerRow.of(own)
    halves = {"second half": (0, 30, 30, 60), "first half": (30, 60, 0, 30)}
    rows = {}
    for name, (a, b, c, d) in halves.items():
        learnt, judged = (steer_record(ride.between(*ends), 0.005) for ends in ((a, b), (c, d)))
        try:
            fit_steer_row([learnt], {"K0_dd": row.K0_dd})
        except LogError as error:
            print(f"\nDavis by acceleration: {error.found}")
        fit = fit_steer_row([learnt], {"K0_dd": row.K0_dd}, by="torque")
        mass = fit_steer_row([learnt], {"K0_dd": row.K0_dd, "M_dd": row.M_dd, "M_dphi": row.M_dphi}, by="torque")
        print(f"by torque: R2 {fit.r2:.3f}: {show(fit)}")
        rubs = fit.row.friction
        published = {"measured bicycle": row, "measured bicycle, with friction": row.with_values(friction=rubs)}
        published |= {"Moore's identified": MOORE, "Moore's, with friction": MOORE.with_values(friction=rubs)}
        pull = judged_pull(ride, (c, d))[judged.used]
        left = (judged.torque - fit.row.torque(judged.motion))[judged.used]
        print(
            f"pull on what the row leaves: {pull @ left / (pull @ pull):.4f} m, correlation {np.corrcoef(pull, left)[0, 1]:.3f}"
        )
        rows[name] = ways([learnt], judged, published, {"torque": fit, "torque, inertias given": mass})
        part = ride.between(c, d)
        for label, chosen in (
            ("all free", fit.row),
            ("inertias given", mass.row),
            ("Moore's, friction", published["Moore's, with friction"]),
        ):
            if chosen.M_dd > 0:
                print(f"| causal, judged on the {name}, {label} | {shifted(*causal(part, chosen, v, 0.005), 0.005)} |")
    print()
    table(rows)
    print("\nthe measured bicycle, whole ride, mean taken out: R2 at", SHIFTS)
    for label, chosen in (("steer row", row), ("steer row, friction", row.with_values(friction=0.38))):
        found, truth = causal(ride, chosen, v, 0.005)
        print(f"| {label} | {shifted(found - found.mean() + truth.mean(), truth, 0.005)} |")
    for label, known in (("both rows, pull known", True), ("both rows, pull unknown", False)):
        print(f"| {label} | {shifted(*both_rows(ride, own, v, known), 0.005)} |")
    whole = steer_record(ride, 0.005)
    M, C, K = own.at(v)
    m, pull = whole.motion, 0.94 * judged_pull(ride, (0, 60))
    moment = (
        M[0] @ [m.roll_acceleration, m.steer_acceleration]
        + C[0] @ [m.roll_rate, m.steer_rate]
        + K[0] @ [m.roll, m.steer]
    )
    pull, moment = pull[whole.used], moment[whole.used]
    slope = pull @ moment / (pull @ pull)
    print(f"roll row against the pull's moment: correlation {np.corrcoef(pull, moment)[0, 1]:.2f}, slope {slope:.2f}")


def judged_pull(ride: cd.Log, ends: tuple[int, int]) -> np.ndarray:
    """The pull on the rope, N, filtered as the record is."""
    from scipy.signal import butter, sosfiltfilt

    force = ride.between(*ends)["roll_moment"].values / 0.94
    return np.asarray(sosfiltfilt(butter(2, 5.0, fs=200.0, output="sos"), force))


def both_rows(ride: cd.Log, own: BicycleMatrices, v: float, known: bool) -> tuple[np.ndarray, np.ndarray]:
    """The torque by roll and steer row together, the pull on the rope known or not; noises as serve this ride best."""
    unknown = ("rider_torque",) if known else ("rider_torque", "roll_moment")
    noise, roll, angle = ([3.0**2], 20.0, 0.1) if known else ([10.0**2, 3000.0**2], 0.1, 3e-3)
    design = design_disturbance_filter(
        bicycle_model(own, v), unknown, 0.005, unknown_noise=noise, output_noise=[angle**2, 1e-3**2, 3e-2**2, 3e-2**2],
        state_noise=[0, 0, roll**2, 0.5**2],
    )  # fmt: skip
    steer = ride["steer_angle"]
    ride = ride.with_signals(cd.Signal("steer_rate", steer.time, np.gradient(steer.values, steer.time), "rad/s"))
    estimate = cd.compile(disturbance_observer(design, [1.0] * 4 + [10.0, 300.0][: len(unknown)])).run(ride)
    found, truth = estimate["rider_torque"].values[600:], ride["rider_torque"].values[600:]
    return found - found.mean() + truth.mean(), truth


if __name__ == "__main__":
    main()
