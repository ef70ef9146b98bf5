"""The alignment map identified: made drives whose map is known, refusals, and a car with a torque sensor."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import codriver as cd
from codriver.identify import identify_alignment
from codriver.identify.alignment_drive import alignment_drive
from codriver.identify.alignment_fit import LETTERS, modelled
from codriver.identify.alignment_holdout import features, hold_out, regression
from codriver.models.alignment import AlignmentModel
from conftest import recording

NAMES = Path(__file__).parent / "names" / "udacity.toml"
TRUTH = AlignmentModel(1.6, 1.4, -0.1, 0.045, 0.45, 15.0, 2.8, 28.0, 0.5, 0.2, 0.003)
DT = 0.05


def made_drive(seed: int, seconds: float = 400.0, curves: float = 1.0, noise: float = 0.1, steady: float | None = None,
               truth: AlignmentModel = TRUTH) -> cd.Log:  # fmt: skip
    """A road of curves at changing speeds, corrections of the driver, and torque with a slow and a fast error."""
    from scipy.ndimage import gaussian_filter1d

    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / DT)) * DT

    def walk(width: float, sd: float) -> np.ndarray:
        x = gaussian_filter1d(rng.standard_normal(t.size), width / DT)
        return sd * x / x.std()

    speed = np.full(t.size, steady) if steady is not None else np.clip(16 + walk(25.0, 7.0), 3.0, 33.0)
    kappa = curves * walk(3.0, 1.0) * 1.2 / speed**2
    angle = kappa * 15.0 * 2.8 * (1 + speed**2 / 28.0**2) + walk(0.4, 0.01)
    states, torque, rate = dict(truth.states), np.empty(t.size), np.gradient(angle, DT)
    for k in range(t.size):
        states = truth.advance(states, float(angle[k]), float(speed[k]), DT)
        torque[k] = truth.friction(states, rate[k]) - truth.torque(states, float(angle[k]), float(speed[k]))
    torque += noise * (walk(1.5, 1.0) + 0.5 * rng.standard_normal(t.size))
    values = {"steering_wheel_angle": (angle, "rad"), "longitudinal_speed": (speed, "m/s"),
              "steering_wheel_torque": (np.round(torque / 0.0625) * 0.0625, "N*m")}  # fmt: skip
    return cd.Log.of([cd.Signal(name, t, x, unit) for name, (x, unit) in values.items()], f"made{seed}")


def scaled(log: cd.Log, name: str, factor: float) -> cd.Log:
    return log.with_signals(cd.Signal(name, log[name].time, factor * log[name].values, log[name].unit))


@pytest.fixture(scope="module")
def made() -> list[cd.Log]:
    return [made_drive(1), made_drive(2), made_drive(3)]


class TestMade:
    def test_recovers_the_map(self, made):
        """Within four standard errors, which are small; and the map itself within 5 % of the torque's spread."""
        fit = identify_alignment(made)
        assert not fit.refused
        for letter, c in fit.coefficients.items():
            true = getattr(TRUTH, LETTERS[letter][0])
            slack = 0.15 * abs(true) if letter in ("b_s", "w") else 0.0  # the rate is low-passed, the torque quantised
            assert abs(c.value - true) < 4 * c.sd + slack, letter
            assert c.low < c.value < c.high
        assert fit.coefficients["k_a"].sd < 0.2
        assert fit.coefficients["T_c"].value == pytest.approx(0.2, rel=0.15)
        drive = alignment_drive(made_drive(9, noise=0.0), TRUTH)
        off = modelled(drive, fit.model) - modelled(drive, TRUTH)
        assert np.std(off) < 0.05 * np.std(drive.torque)

    @pytest.mark.slow
    def test_standard_errors_cover(self):
        """Over made drives, k_a and T_0 lie within two standard errors of the truth about as often as they say."""
        off = []
        for seed in range(20, 32):
            fit = identify_alignment([made_drive(seed, noise=0.2)])
            off += [
                (fit.coefficients[name].value - true) / fit.coefficients[name].sd
                for name, true in (("k_a", 1.6), ("T_0", -0.1))
            ]
        assert 0.5 < np.sqrt(np.mean(np.square(off))) < 2.0

    @pytest.mark.slow
    def test_error_and_its_time_come_from_what_was_held_out(self, made):
        fit = identify_alignment(made)
        assert fit.held.by_drive
        assert len(fit.held.parts) == 3
        # slow error 0.1, fast 0.05, quantisation 0.018 N m; the slow one alike over sqrt(pi) times its 1.5 s
        assert fit.held.whole.rmse["map"] == pytest.approx(np.sqrt(0.1**2 + 0.05**2 + 0.018**2), rel=0.15)
        assert 1.0 < fit.held.time < 4.0
        assert fit.held.whole.rmse["map"] < fit.held.whole.rmse["regression"] < fit.held.whole.rmse["mean"]

    @pytest.mark.slow
    def test_blocks_of_one_drive_see_nothing_of_themselves(self, made):
        """A part left out is the same whatever its torque is."""
        drive = alignment_drive(made[0], TRUTH)
        held = hold_out([drive], TRUTH)
        assert not held.by_drive
        assert len(held.parts) == 6
        assert np.isfinite(held.predicted[0][drive.keep]).all()
        spoilt = made[0].with_signals(
            cd.Signal("steering_wheel_torque", drive.time, np.where(drive.time < 60, 7.0, drive.torque), "N*m")
        )
        again = hold_out([alignment_drive(spoilt, TRUTH)], TRUTH)
        first = drive.time < 60
        assert np.array_equal(again.predicted[0][first], held.predicted[0][first])
        assert not np.array_equal(again.predicted[0][~first], held.predicted[0][~first])

    def test_regression_is_least_squares(self, made):
        drive = alignment_drive(made[0], TRUTH)
        rows = [(drive, drive.keep)]
        left = (drive.torque - features(drive) @ regression(rows))[drive.keep]
        assert np.abs(features(drive)[drive.keep].T @ left).max() < 1e-6

    def test_vehicle(self, made, tmp_path):
        fit = identify_alignment(made)
        path = cd.vehicles.save_vehicle(fit.vehicle(name="made"), tmp_path / "made.toml")
        again = AlignmentModel.from_vehicle(cd.load_vehicle(path))
        assert again == fit.model
        loaded = cd.load_vehicle(path)
        assert loaded.number("alignment_torque_sd") == fit.held.whole.rmse["map"]
        assert loaded.number("alignment_torque_time") == fit.held.time
        assert loaded.parameters["alignment_gain"].sd == fit.coefficients["k_a"].sd

    @pytest.mark.slow
    def test_geometry_scales_the_gain_alone(self, made):
        """Twice the ratio is half the curvature: k_a doubles, and the torque stays."""
        ratio = cd.Vehicle("car", "", "", {}).with_parameter("steering_ratio", 30.0)
        one, two = identify_alignment(made[:1]), identify_alignment(made[:1], ratio)
        assert two.rmse == pytest.approx(one.rmse, rel=0.02)
        assert two.coefficients["k_a"].value / one.coefficients["k_a"].value == pytest.approx(2, rel=0.1)
        assert "steering_ratio" in one.assumed
        assert "steering_ratio" not in two.assumed

    def test_late_angle_is_told(self, made):
        late = cd.Signal("steering_wheel_angle", made[0].signals["steering_wheel_angle"].time + 0.1,
                         made[0]["steering_wheel_angle"].values, "rad")  # fmt: skip
        fit = identify_alignment([made[0].with_signals(late)])
        assert fit.lead == pytest.approx(0.1, abs=0.051)
        assert any("ahead of the angle" in f.text for f in fit.findings)


class TestRefusals:
    @pytest.mark.slow
    def test_one_speed_does_not_tell_the_bank(self):
        fit = identify_alignment([made_drive(5, steady=20.0)])
        assert "e_max" in {r.name for r in fit.refused}
        assert "k_a" in fit.coefficients
        assert fit.model.bank == 0.04
        assert "road_bank" not in fit.vehicle()

    @pytest.mark.slow
    def test_gentle_curves_do_not_tell_the_bend(self):
        fit = identify_alignment([made_drive(6, curves=0.25)])
        assert "T_s" in {r.name for r in fit.refused}

    def test_straight_road(self):
        with pytest.raises(cd.errors.LogError, match="record drives with curves"):
            identify_alignment([made_drive(7, curves=0.0)])

    @pytest.mark.parametrize(
        ("name", "factor", "said"),
        [
            ("steering_wheel_angle", np.pi / 180, "curves, the angle is likely in rad where the names file says deg"),
            ("longitudinal_speed", 1 / 3.6, "curves, the speed is likely in m/s where the names file says km/h"),
        ],
    )
    def test_curves_in_another_unit(self, made, name, factor, said):
        """They look straight; the unit is told, not that curves are missing."""
        with pytest.raises(cd.errors.LogError, match=said) as refused:
            identify_alignment([scaled(made[0], name, factor)])
        assert "s of curves" in str(refused.value)
        assert "record drives with curves" not in str(refused.value)

    def test_town_in_kmh(self):
        with pytest.raises(cd.errors.LogError, match="km/h"):
            identify_alignment([scaled(made_drive(4, steady=20.0), "longitudinal_speed", 3.6)])

    def test_degrees_out_of_range(self):
        """As a reader leaves them: what cannot be an angle in rad is no number."""
        log = scaled(made_drive(8, seconds=60.0), "steering_wheel_angle", 180 / np.pi)
        angle = log["steering_wheel_angle"]
        left = np.where(np.abs(angle.values) > 20, np.nan, angle.values)
        with pytest.raises(cd.errors.LogError, match=r"out of range.*likely degrees"):
            identify_alignment([log.with_signals(cd.Signal(angle.name, angle.time, left, "rad"))])

    def test_degrees_for_radians(self, made):
        with pytest.raises(cd.errors.LogError, match="degrees"):
            identify_alignment([scaled(made[0], "steering_wheel_angle", 180 / np.pi)])

    def test_kmh_for_speed(self, made):
        with pytest.raises(cd.errors.LogError, match="km/h"):
            identify_alignment([scaled(made[0], "longitudinal_speed", 3.6)])

    @pytest.mark.parametrize("name", ["steering_wheel_torque", "steering_wheel_angle"])
    def test_opposite_sign(self, made, name):
        with pytest.raises(cd.errors.LogError, match="opposite signs"):
            identify_alignment([made[1], scaled(made[0], name, -1.0)])

    def test_torque_at_rest(self, made):
        with pytest.raises(cd.errors.LogError, match="throughout"):
            identify_alignment([scaled(made[0], "steering_wheel_torque", 0.0)])

    def test_torque_of_something_else(self, made):
        other = made[0].with_signals(
            cd.Signal("steering_wheel_torque", made[0]["steering_wheel_angle"].time,
                      np.random.default_rng(0).standard_normal(len(made[0]["steering_wheel_angle"])), "N*m")
        )  # fmt: skip
        with pytest.raises(cd.errors.LogError, match="does not follow the curves"):
            identify_alignment([other])

    def test_short_or_incomplete(self, made):
        with pytest.raises(cd.errors.LogError, match="of driving"):
            identify_alignment([made_drive(8, seconds=20.0)])
        with pytest.raises(cd.errors.MissingSignal, match="steering_wheel_torque"):
            identify_alignment([cd.Log.of([made[0]["steering_wheel_angle"], made[0]["longitudinal_speed"]])])
        with pytest.raises(cd.errors.LogError, match="no drive"):
            identify_alignment([])

    def test_too_short_to_hold_out(self):
        fit = identify_alignment([made_drive(4, seconds=120.0)])
        assert fit.held.whole is None
        assert "alignment_torque_sd" not in fit.vehicle()
        assert any("too short" in f.text for f in fit.findings)


@pytest.fixture(scope="module")
def mkz() -> dict[str, cd.Log]:
    folder = recording("udacity-lincoln-mkz")
    files = {"hmb1": "hmb1-20hz.csv", "hmb2": "hmb2-20hz.csv", "hmb6": "hmb6-steering-50hz.csv"}
    return {name: cd.read(folder / file, names=NAMES) for name, file in files.items()}


class TestLincoln:
    """A car with a sensor; ERRATA's regression of nine features has R2 0.17, RMSE 0.42 N m on hmb6."""

    def test_a_drive_not_seen(self, mkz):
        fit = identify_alignment([mkz["hmb1"], mkz["hmb2"]])
        drive = alignment_drive(mkz["hmb6"], fit.model)
        seen = [(d, d.keep) for d in fit.drives]
        y = drive.torque[drive.keep]
        r2 = {
            name: 1 - np.mean((y - x[drive.keep]) ** 2) / np.var(y)
            for name, x in (("map", modelled(drive, fit.model)), ("regression", features(drive) @ regression(seen)))
        }
        assert r2["map"] > 0.45
        assert r2["map"] > r2["regression"] + 0.2 > 0.37
        assert fit.r2 > 0.85

    def test_each_drive_from_the_other(self, mkz):
        held = identify_alignment([mkz["hmb1"], mkz["hmb2"]]).held
        assert [part.name for part in held.parts] == ["hmb1-20hz.csv", "hmb2-20hz.csv"]
        for part, r2 in zip(held.parts, (0.83, 0.80), strict=True):
            assert part.r2["map"] > r2
            assert part.rmse["map"] < part.rmse["regression"]

    def test_level_roads_would_be_worse(self, mkz):
        """The bank is what tells hmb6: without it the map does not get there even when fitted to it."""
        from dataclasses import replace

        from codriver.identify.alignment_fit import fit_map

        drive = alignment_drive(mkz["hmb6"], TRUTH)
        rows = [(drive, drive.keep)]
        banked = fit_map(rows, TRUTH)
        level = fit_map(rows, replace(TRUTH, bank=0.0), [name for name in LETTERS if name not in ("e_max", "q")])
        assert banked.sd < 0.75 * level.sd

    @pytest.mark.slow
    def test_command_line(self, mkz, tmp_path):
        from codriver.cli.app import app

        folder = recording("udacity-lincoln-mkz")
        out, page = tmp_path / "car.toml", tmp_path / "car.html"
        done = CliRunner().invoke(
            app, ["identify", "alignment", str(folder / "hmb1-20hz.csv"), str(folder / "hmb2-20hz.csv"), "--names", str(NAMES),
                  "-o", str(out), "--report", str(page), "--json"]
        )  # fmt: skip
        assert done.exit_code == 0, done.output
        told = json.loads(done.stdout)
        assert told["held_out"]["hmb2-20hz.csv"]["r2"]["map"] > 0.8
        assert cd.load_vehicle(out).number("alignment_gain") == told["coefficients"]["k_a"]["value"]
        text = page.read_text(encoding="utf-8")
        for words in (
            "Torque over lateral acceleration",
            "Steady turns at several speeds",
            "hmb2-20hz.csv",
            "map against regression",
        ):
            assert words in text
        done = CliRunner().invoke(
            app, ["identify", "alignment", str(folder / "hmb1-20hz.csv"), "--names", str(NAMES), "-o", str(out), "--overwrite"]
        )  # fmt: skip
        assert done.exit_code == 0, done.output
        assert "is not told" in done.output
        assert "left out (blocks)" in done.output
