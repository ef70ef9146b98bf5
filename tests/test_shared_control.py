"""Shared control: against the drive alone, closed forms, brute integration, the batch prediction, and mirrored roads."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from math import inf, pi

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from codriver.cli.app import app
from codriver.drivers.learned import LearnedDriver, fit_driver, observer_of, save_driver
from codriver.errors import CodriverError, UsageError
from codriver.models.road_sight import PathAhead
from codriver.program import Program, compile
from codriver.simulate.assist import UNKNOWN, Assist, AssistState, Fade, Foretold, advance
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, circuit_path, drive_along, simulate_circuit
from codriver.simulate.circuit_drivers import circuit_driver
from codriver.simulate.circuit_way import way_curvature
from codriver.simulate.detour import Detour
from codriver.simulate.shared_control import Helper, SharedSetting, simulate_shared
from codriver.simulate.shared_outcomes import (
    Outcome,
    change_of,
    compare_assists,
    mean_outcome,
    outcome,
    reversal_rate,
    verdict,
)
from codriver.simulate.shared_stability import largest_gain, slowest_decay
from codriver.simulate.steering import Wheel
from codriver.simulate.variability import Variability, Variation
from driven import driven

ONE_LAP = CircuitSetting(laps=1, direction="left")
VARYING = replace(ONE_LAP, variability=Variability())
SMOOTH = Wheel(0.0298, 0.3515, 0.0)
BARE = {"lag": 0.0, "limit": inf, "rate": inf, "fade": None}


@cache
def anna(kind: str = "ridge") -> LearnedDriver:
    """Learnt from two drives without assist."""
    return fit_driver([driven(seed=seed, direction="left") for seed in (1, 2)], kind, name="anna")


@cache
def compiled(kind: str = "ridge") -> Program:
    return compile(observer_of(anna(kind)))


@cache
def unhelped() -> CircuitDrive:
    return simulate_circuit(VARYING, seed=4)


def along(setting: CircuitSetting, path: PathAhead, n: int, assist: Assist, **more: object) -> CircuitDrive:
    """A drive along a path with an assist, by a driver who is always the same and a sensor without noise."""
    given = {"varied": Variation.none(n), "noise": np.zeros(n), "model": None, **more}
    helper = Helper(assist, setting, path, n, given["model"])
    return drive_along(setting, path, n, given["varied"], given["noise"], helper)


def turn(setting: CircuitSetting, seconds: float, curvature: float) -> tuple[PathAhead, int]:
    """A path of one curvature."""
    n = round(seconds / setting.dt)
    place = setting.car.speed * setting.dt * np.arange(n + 1000)
    return PathAhead.of(place, np.full(place.size, curvature)), n


class TestLoop:
    @pytest.mark.parametrize("kind", ["none", "present", "predicted", "path"])
    def test_gain_0_is_the_drive_alone_to_the_bit(self, kind: str) -> None:
        alone = unhelped()
        shared = simulate_shared(SharedSetting(VARYING, Assist(kind, 0.0)), compiled(), seed=4).drive
        for name in ("angle", "rate", "driver_torque", "measured_torque", "offset", "heading", "yaw_rate"):
            assert np.array_equal(getattr(shared, name), getattr(alone, name))
        assert not shared.motor_torque.any()

    @pytest.mark.parametrize(("gain", "used"), [(0.5, 0.0), (0.5, 1.0), (1.0, 0.4)])
    def test_power_steering_in_a_steady_turn(self, gain: float, used: float) -> None:
        whole = SharedSetting(replace(ONE_LAP, wheel=SMOOTH), Assist("present", gain), used)
        s, rho = whole.driven(), 0.01
        v, car, single = s.car.speed, s.car, s.single_track()
        drive = along(s, *turn(s, 40, rho), whole.assist)
        # Tyres ask for what they ask for; of that the driver bears 1 / (1 + g).
        slip = single.front_mass * v * v * rho / single.front_stiffness
        asked = car.alignment / car.ratio * slip
        assert drive.driver_torque[-1] == pytest.approx(asked / (1 + gain), rel=1e-6)
        assert drive.motor_torque[-1] == pytest.approx(gain * asked / (1 + gain), rel=1e-6)
        # And he sits where the wheel angle that he wants balances arms that have less to bear.
        d, y, psi, angle = s.driver, drive.offset[-1], drive.heading[-1], drive.angle[-1]
        column = ONE_LAP.driver.column_gain * (1 - used * gain / (1 + gain))
        wanted = (asked / (1 + gain) + d.reflex * angle) / (column * v + d.reflex)
        near, far = d.near * rho / 2 - y / d.near - psi, d.far * v * rho / 2 - y / (d.far * v) - psi
        assert d.anticipation * far + d.compensation / v * near == pytest.approx(wanted, rel=1e-6)

    def test_path_assist_and_driver_in_a_steady_turn(self) -> None:
        assist = Assist("path", 1.0, fade=None)
        s, rho = replace(ONE_LAP, wheel=SMOOTH), -0.008
        drive = along(s, *turn(s, 40, rho), assist)
        single, v = s.single_track(), s.car.speed
        asked = s.car.alignment / s.car.ratio * single.front_mass * v * v * rho / single.front_stiffness
        assert drive.driver_torque[-1] + drive.motor_torque[-1] == pytest.approx(asked, rel=1e-6)
        assert drive.motor_torque[-1] == pytest.approx(-assist.stiffness * drive.offset[-1], rel=1e-5)

    def test_brute_integration_with_power_steering(self) -> None:
        gain, s = 0.7, replace(ONE_LAP, wheel=SMOOTH, torque_noise=0.0, resolution=0.0)
        drive = simulate_shared(SharedSetting(s, Assist("present", gain, **BARE), 0.0)).drive
        v, car, driver = s.car.speed, s.car, s.driver
        model, plane = driver.model(v), s.single_track().model(v)
        fine = np.linspace(0, v * 45, 45001)
        path = PathAhead.of(fine, way_curvature(fine, 1, "left"))
        near, far = path.bend(fine, driver.near), path.bend(fine, driver.far * v)
        back, m = car.alignment / car.ratio, model.A.shape[0]

        def rates(t, x):
            hand, (delta, omega, beta, r, psi, y) = x[:m], x[m:]
            seen = (
                np.interp(v * t, fine, near) - y / driver.near - psi,
                np.interp(v * t, fine, far) - y / (driver.far * v) - psi,
                delta,
            )
            aligned = back * (beta + car.front * r / v - delta / car.ratio)
            pushed = ((1 + gain) * hand[-1] + aligned - s.wheel.damping * omega) / s.wheel.inertia
            slid = plane.A @ [beta, r] + plane.B[:, 0] * delta / car.ratio
            rho = np.interp(v * t, path.distance, path.curvature)
            return np.concatenate(
                [model.A @ hand + model.B @ seen, [omega, pushed], slid, [r - v * rho, v * (psi + beta)]]
            )

        t = np.arange(0, 25, 0.5)
        brute = solve_ivp(rates, (0, 25), np.zeros(m + 6), t_eval=t, max_step=0.03, rtol=1e-6, atol=1e-8).y
        rows = np.searchsorted(drive.time, t - 1e-9)
        for mine, at in ((drive.driver_torque, m - 1), (drive.angle, m), (drive.offset, m + 5)):
            assert np.allclose(mine[rows], brute[at], atol=0.025 * np.abs(brute[at]).max())

    @pytest.mark.parametrize("kind", ["present", "path"])
    def test_left_is_right_in_a_mirror(self, kind: str) -> None:
        path, n = circuit_path(VARYING)
        n = 4000
        noise = 0.02 * np.random.default_rng(1).standard_normal(n)
        varied = Variation.draw(Variability(), n, VARYING.dt, np.random.default_rng(2))
        other_way = PathAhead.of(path.distance, -path.curvature)
        mirrored = replace(varied, near=-varied.near, far=-varied.far, motor=-varied.motor)
        one = along(VARYING, path, n, Assist(kind, 1.0), varied=varied, noise=noise)
        other = along(VARYING, other_way, n, Assist(kind, 1.0), varied=mirrored, noise=-noise)
        for name in ("angle", "driver_torque", "motor_torque", "offset"):
            assert np.array_equal(getattr(one, name), -getattr(other, name))
        assert np.abs(one.motor_torque).max() > 0.3


class TestForetold:
    def test_the_model_says_in_the_loop_what_it_says_afterwards(self) -> None:
        shared = simulate_shared(SharedSetting(VARYING, Assist("predicted", 0.6)), compiled(), seed=7)
        made = anna().predict(shared.drive.log(), with_target=False)
        rows = np.round(made.time / VARYING.dt).astype(int)
        assert rows.size > 1000
        assert np.allclose(shared.foretold[rows], made.mean, atol=1e-12)
        first = np.flatnonzero(np.isfinite(shared.foretold))[0]
        assert first == rows[0]
        # Between its ticks its last word holds.
        assert np.array_equal(shared.foretold[rows], shared.foretold[rows + 9])
        assert shared.horizon == 0.2
        assert shared.foretold_error() < 1.3 * anna().training["held_out_rmse"]

    def test_a_torque_that_stays_is_power_steering_with_a_slow_tick(self) -> None:
        assist = Assist("predicted", 0.6, fade=None)
        drive = simulate_shared(SharedSetting(VARYING, assist), compiled("pwc"), seed=7).drive
        state, error = AssistState(), 0.0
        first = 80  # history of .8 s
        for k in range(2000):
            seen = drive.measured_torque[k - k % 10] if k >= first else 0.0
            state = advance(replace(assist, kind="present"), state, 0.01, seen, error)
            assert state.torque == pytest.approx(drive.motor_torque[k], abs=1e-9)

    def test_what_comes_later_changes_nothing_before(self) -> None:
        path, n = circuit_path(VARYING)
        n, k = 5000, 3200
        rng = np.random.default_rng(5)
        varied, noise = Variation.draw(Variability(), n, 0.01, rng), 0.02 * rng.standard_normal(n)
        late = np.arange(n) > k
        other = Variation(*(np.where(late, 1.3 * v + 0.001, v) for v in vars(varied).values()))
        one, two = (
            along(VARYING, path, n, Assist("predicted", 1.0), varied=v, noise=e, model=compiled())
            for v, e in ((varied, noise), (other, np.where(late, 0.5, noise)))
        )
        assert np.array_equal(one.motor_torque[: k + 1], two.motor_torque[: k + 1])
        assert not np.array_equal(one.motor_torque[k + 1 :], two.motor_torque[k + 1 :])

    @pytest.mark.slow
    def test_who_is_used_to_it_steers_as_before_with_less_torque(self) -> None:
        """Per mille of the offset; half the torque: what is foretold is no better than power steering there."""
        alone = outcome(simulate_shared(SharedSetting(VARYING), seed=3))
        for kind in ("present", "predicted"):
            helped = outcome(simulate_shared(SharedSetting(VARYING, Assist(kind, 1.0)), compiled(), seed=3))
            assert helped.offset == pytest.approx(alone.offset, rel=0.05)
            assert helped.torque == pytest.approx(alone.torque / 2, rel=0.08)
            assert helped.power < 0.8 * alone.power
            assert helped.authority > 0.95

    def test_refusals(self) -> None:
        with pytest.raises(UsageError, match="no driver model"):
            simulate_shared(SharedSetting(ONE_LAP, Assist("predicted")))
        with pytest.raises(UsageError, match=r"ticks every 0\.1 s in a drive that ticks every 0\.03 s"):
            simulate_shared(SharedSetting(replace(ONE_LAP, dt=0.03), Assist("predicted")), compiled())
        log = driven(direction="left")
        sideways = replace(
            log["yaw_rate"], name="lateral_acceleration", values=14 * log["yaw_rate"].values, unit="m/s^2"
        )
        other = compile(observer_of(fit_driver(log.with_signals(sideways), "pwc")))
        with pytest.raises(UsageError, match="a driver model that wants lateral_acceleration"):
            simulate_shared(SharedSetting(ONE_LAP, Assist("predicted")), other)
        with pytest.raises(UsageError, match="assist 'help'"):
            Assist("help")
        with pytest.raises(UsageError, match="gain is -1"):
            Assist("path", -1.0)
        with pytest.raises(UsageError, match="opposed from 2 to 1"):
            Fade(opposed=(2.0, 1.0))
        with pytest.raises(UsageError, match=r"used to it by 1\.2"):
            SharedSetting(used_to_it=1.2)


class TestLaw:
    def test_limit_and_rate(self) -> None:
        assist = Assist("path", 2.0, limit=0.8, rate=3.0, lag=0.0, fade=None)
        drive = simulate_shared(SharedSetting(VARYING, assist), seed=1).drive
        assert np.abs(drive.motor_torque).max() == pytest.approx(0.8, rel=1e-9)
        steps = np.abs(np.diff(drive.motor_torque))
        assert steps.max() == pytest.approx(0.03, rel=1e-9)

    def test_lag(self) -> None:
        state, assist = AssistState(), Assist("present", 2.0, lag=0.1, rate=inf, fade=None)
        for _ in range(10):
            state = advance(assist, state, 0.01, 0.5, 0.0)
        assert state.torque == pytest.approx(1 - np.exp(-1))

    def test_nothing_is_asked_for_before_anything_is_foretold(self) -> None:
        assert advance(Assist("predicted"), AssistState(), 0.01, 3.0, 1.0, UNKNOWN).torque == 0

    @pytest.mark.parametrize("hands_off", [True, False])
    def test_authority_goes_where_the_driver_does_otherwise(self, hands_off: bool) -> None:
        """2 N m are foretold, sd 0.15. He lets go; or he pulls the other way."""
        assist, state = Assist("predicted", 1.0), AssistState()
        for _ in range(300):
            state = advance(assist, state, 0.01, 2.0, 0.0, Foretold(2.0, 0.15, 2.0))
        assert (state.authority, state.torque) == (1.0, pytest.approx(2.0))
        torques = []
        for _ in range(100):
            state = advance(assist, state, 0.01, 0.0 if hands_off else -2.0, 0.0, Foretold(2.0, 0.15, 2.0))
            torques.append(state.torque)
        assert torques[50] < 0.3
        assert torques[-1] < 0.01
        back = [state := advance(assist, state, 0.01, 2.0, 0.0, Foretold(2.0, 0.15, 2.0)) for _ in range(500)]
        assert back[50].authority < 0.5
        assert back[-1].authority > 0.95

    def test_he_can_drive_round_something_against_a_path_assist(self) -> None:
        around = Detour(5.0, 6.0, 1.5)
        s = replace(CircuitSetting(detours=(around,)), wheel=SMOOTH)
        path, n = turn(s, 14, 0.0)
        found = {
            name: along(s, path, n, assist)
            for name, assist in {
                "alone": Assist(), "fading": Assist("path", 2.0), "stubborn": Assist("path", 2.0, fade=None),
            }.items()
        }  # fmt: skip
        reached = {name: drive.offset.max() for name, drive in found.items()}
        effort = {name: np.sqrt(np.mean(drive.driver_torque**2)) for name, drive in found.items()}
        assert reached["alone"] > 1.4
        assert reached["fading"] > 1.0
        assert reached["stubborn"] < 0.7
        assert effort["fading"] < 0.7 * effort["stubborn"]

    def test_a_predicted_assist_does_not_hinder_a_detour(self) -> None:
        s = replace(VARYING, detours=(Detour(30.0, 6.0, 1.5),))
        rows = slice(2900, 3800)
        alone = simulate_shared(SharedSetting(s), seed=2).drive.offset[rows]
        helped = simulate_shared(SharedSetting(s, Assist("predicted", 1.0)), compiled(), seed=2).drive.offset[rows]
        assert np.abs(helped - alone).max() < 0.25 * np.ptp(alone)


class TestStability:
    @pytest.mark.parametrize(("lag", "part"), [(0.03, 0.7), (0.03, 1.2), (0.2, 0.9)])
    def test_the_simulated_wheel_shakes_as_the_eigenvalues_say(self, lag: float, part: float) -> None:
        """What a look to the side leaves behind dies out or grows; a tick of 2 ms costs 0.05 1/s."""
        circuit = replace(ONE_LAP, wheel=SMOOTH, resolution=0.0, dt=0.002)
        margin = largest_gain(SharedSetting(circuit, Assist("present", lag=lag)))
        whole = SharedSetting(circuit, Assist("present", part * margin, **{**BARE, "lag": lag}))
        s = whole.driven()
        path, n = turn(s, 14, 0.0)
        look = replace(Variation.none(n), near=np.where(np.arange(n) < 100, 1e-4, 0.0))
        quick = np.diff(along(s, path, n, whole.assist, varied=look).driver_torque)
        early, late = (np.std(quick[int(a * n) : int((a + 0.2) * n)]) for a in (0.3, 0.8))
        assert -np.log(late / early) / 7 == pytest.approx(slowest_decay(whole), abs=0.06)

    def test_margins(self) -> None:
        soft, stiff = (
            largest_gain(SharedSetting(replace(ONE_LAP, driver=circuit_driver(name)), Assist("present")))
            for name in ("david", "emma")
        )
        assert stiff < 0.6 < 2 < soft
        assert slowest_decay(SharedSetting(ONE_LAP, Assist("path", 1.0))) > 0
        # Without assist: the loop of driver, car and wheel, and the motor's own lag.
        bare = slowest_decay(SharedSetting(ONE_LAP, Assist("none", lag=1e-3)))
        assert bare == pytest.approx(slowest_decay(SharedSetting(ONE_LAP, Assist("present", 0.0, lag=1e-3))))
        with pytest.raises(UsageError, match="simulate it"):
            slowest_decay(SharedSetting(ONE_LAP, Assist("predicted")))
        wild = replace(ONE_LAP.driver, reflex=60.0)
        with pytest.raises(UsageError, match="unstable without assist"):
            largest_gain(SharedSetting(replace(ONE_LAP, driver=wild), Assist("present")))

    @pytest.mark.slow
    def test_a_predicted_torque_shakes_later_than_the_present_one(self) -> None:
        """Stiff arms and a gain of 1: power steering shakes, what is foretold does not follow quick torques."""
        stiff = replace(VARYING, driver=circuit_driver("emma"))
        drives = [driven("emma", seed, direction="left") for seed in (1, 2)]
        model = compile(observer_of(fit_driver(drives, "ridge")))
        found = compare_assists(
            stiff, {k: Assist(k, 1.0, fade=None) for k in ("none", "present", "predicted")}, model, (3,)
        )
        none, present, predicted = (found[kind][0] for kind in ("none", "present", "predicted"))
        assert present.power > 10 * none.power
        assert predicted.power < 0.6 * none.power
        assert predicted.offset < 1.1 * none.offset


class TestOutcomes:
    def test_reversals_of_a_sine(self) -> None:
        t = np.arange(0, 120, 0.01)
        assert reversal_rate(0.1 * np.sin(2 * pi * 0.2 * t), 0.01) == pytest.approx(24, abs=1)
        assert reversal_rate(0.025 * np.sin(2 * pi * 0.2 * t), 0.01) == 0
        # Quick trembling is filtered out, slow steering with a tremble on it counts once.
        assert reversal_rate(0.1 * np.sin(2 * pi * 4 * t), 0.01) == 0
        assert reversal_rate(0.1 * np.sin(2 * pi * 0.2 * t) + 0.05 * np.sin(2 * pi * 5 * t), 0.01) == pytest.approx(
            24, abs=1
        )
        assert reversal_rate(t, 0.01) == 0

    def test_figures_of_a_drive(self) -> None:
        shared = simulate_shared(SharedSetting(VARYING, Assist("path", 1.0)), seed=1)
        d, found = shared.drive, outcome(shared)
        late = d.time >= 5
        assert found.squared == pytest.approx(found.torque**2)
        assert found.assist == pytest.approx(np.sqrt(np.mean(d.motor_torque[late] ** 2)))
        against = sum(
            min(abs(a), abs(b)) > 0.1 and a * b < 0
            for a, b in zip(d.driver_torque[late].tolist(), d.motor_torque[late].tolist(), strict=True)
        )
        assert found.opposed_share == pytest.approx(against / late.sum())
        assert found.opposed_share > 0.005
        # y' = v (psi + beta), so the course error is what the offset changes by.
        slope = np.gradient(d.offset, d.time)[late] / ONE_LAP.car.speed
        assert found.heading == pytest.approx(np.sqrt(np.mean(slope**2)), rel=0.01)

    @pytest.mark.slow
    def test_mean_sd_and_change(self) -> None:
        found = compare_assists(VARYING, {"none": Assist(), "path": Assist("path", 1.0)}, seeds=(1, 2))
        mean, spread = mean_outcome(found["none"])
        values = [one.offset for one in found["none"]]
        assert mean.offset == pytest.approx(np.mean(values))
        assert spread.offset == pytest.approx(np.std(values, ddof=1))
        assert np.isnan(mean.foretold)
        change, error = change_of(found["path"], found["none"], "offset")
        each = [a.offset / b.offset - 1 for a, b in zip(found["path"], found["none"], strict=True)]
        assert (change, error) == (pytest.approx(np.mean(each)), pytest.approx(abs(each[0] - each[1]) / 2))
        assert change < -0.2
        assert np.isnan(mean_outcome(found["none"][:1])[1].offset)
        said = [(f.severity, f.text.split(":")[0]) for f in verdict(found)]
        assert said[0] == ("ok", "path against no assist, off the path")
        doubled = [replace(one, power=2 * one.power) for one in found["none"]]
        assert verdict({"none": found["none"], "present": doubled})[0].severity == "bad"
        with pytest.raises(ValueError, match="no drive"):
            mean_outcome(list[Outcome]())


class TestCommand:
    @pytest.mark.slow
    def test_with_and_without(self, tmp_path) -> None:
        model, out, report = tmp_path / "anna.driver", tmp_path / "helped", tmp_path / "helped.html"
        save_driver(anna(), model)
        command = ["simulate", "shared", "-o", str(out), "--model", str(model), "--gain", "1", "--direction", "left"]
        done = CliRunner().invoke(
            app, [*command, "--drives", "2", "--report", str(report), "--json"], catch_exceptions=False
        )
        assert done.exit_code == 0, done.output
        told = json.loads(done.output)
        assert list(told["outcomes"]) == ["none", "present", "predicted"]
        none, predicted = (told["outcomes"][kind] for kind in ("none", "predicted"))
        assert predicted["torque"]["mean"] < 0.6 * none["torque"]["mean"]
        assert none["foretold"]["mean"] is None
        table = pq.read_table(out / "truth.parquet")
        assert {"authority", "driver_torque_ahead"} <= set(table.column_names)
        assert (out / "drive.csv").read_text().splitlines()[0].endswith(",MotorTorque")
        assert "Change against no assist" in report.read_text()
        assert not any("learnt at" in f["text"] for f in told["findings"])
        slower = (
            CliRunner()
            .invoke(app, [*command, "--overwrite", "--drives", "1", "--speed", "40", "--report", str(report)])
            .output
        )
        assert "drives at 40 km/h here" in report.read_text()
        assert "learnt at 50 km/h on average, and drives at 40 km/h here" in slower
        again = CliRunner().invoke(app, command)
        assert isinstance(again.exception, CodriverError)
        said = CliRunner().invoke(
            app, [*command[:3], str(tmp_path / "b"), "--assist", "path", "--drives", "1", "--direction", "left"],
            catch_exceptions=False,
        ).output  # fmt: skip
        assert "no assist" in said
        assert "off the path, rms, m" in said

    def test_predicted_needs_a_model(self, tmp_path) -> None:
        done = CliRunner().invoke(app, ["simulate", "shared", "-o", str(tmp_path / "x")])
        assert isinstance(done.exception, UsageError)
        assert "codriver driver fit" in str(done.exception)
