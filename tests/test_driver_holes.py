"""Drives with holes: cut there, the same driver found, and what is left out named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.errors import LogError, MissingSignal
from codriver.identify.driver_fit import identify_driver
from codriver.identify.driver_holes import Hole, between, holes_of, holes_told
from codriver.identify.driver_pieces import drive_pieces
from codriver.identify.driver_record import driver_record
from codriver.identify.driver_verdict import driver_findings
from codriver.models.two_point import TwoPointDriver
from driven import driven


@pytest.fixture(scope="module")
def clean() -> cd.Log:
    """Two laps each way of a driver who is always the same, 8.4 minutes."""
    return driven("carla", laps=2, varies=False)


def holed(log: cd.Log, name: str, *holes: tuple[float, float]) -> cd.Log:
    """The log without the samples of a signal in some stretches."""
    signal = log[name]
    there = ~np.any([(signal.time > a) & (signal.time < b) for a, b in holes], axis=0)
    return log.with_signals(replace(signal, time=signal.time[there], values=signal.values[there]))


class TestCut:
    def test_the_same_driver_as_from_the_whole(self, clean):
        asked = ("anticipation", "compensation", "reflex")
        whole = identify_driver(clean, asked=asked)
        fit = identify_driver(holed(clean, "driver_torque", (200.0, 220.0)), asked=asked)
        assert len(fit.records) == 2
        assert fit.seconds == pytest.approx(whole.seconds - 20.0 - 12.4, abs=0.5)
        for name, p in whole.parameters.items():
            assert fit.parameters[name].value == pytest.approx(p.value, abs=p.sd)
            assert fit.parameters[name].sd == pytest.approx(p.sd, rel=0.2)
        rows = slice(fit.records[1].first, fit.records[1].last)
        assert np.std((fit.records[1].torque - fit.torque(1))[rows]) == pytest.approx(fit.rms, rel=0.1)
        assert fit.records[1].start == pytest.approx(220.0)

    def test_what_is_left_out_is_named(self, clean):
        log = holed(clean, "yaw_rate", (10.0, 12.0))  # not used: offset and heading error are there
        log = holed(holed(log, "driver_torque", (100.0, 101.0)), "road_curvature", (150.0, 170.0), (165.0, 180.0))
        drive = drive_pieces(replace(log, source="laps"), 6.0, 1.3)
        assert [(round(a), round(b)) for a, b in drive.spans] == [(0, 100), (180, round(clean.stop))]
        (short,) = drive.left_out
        assert (round(short.start), round(short.stop), short.why) == (101, 150, "shorter than 60 s")
        (finding,) = drive.findings()
        assert finding.severity == "warn"
        for said in (
            "driver_torque has a hole of 1.0 s at 100.0 s", "road_curvature has a hole of 30.0 s at 150.0 s",
            "2 pieces used", "left out 101.0-150.0 s: shorter than 60 s",
        ):  # fmt: skip
            assert said in finding.text

    def test_a_piece_that_cannot_be_used_does_not_stop_the_others(self, clean):
        v = clean["longitudinal_speed"]
        wavy = replace(v, values=np.where(v.time > 210.0, v.values * (1 + 0.2 * np.sin(0.1 * v.time)), v.values))
        log = holed(clean.with_signals(wavy), "driver_torque", (200.0, 220.0))
        drive = drive_pieces(log, 6.0, 1.3)
        assert len(drive.records) == 1
        assert "of spread" in drive.left_out[0].why

    def test_signs_are_told_of_each_piece(self, clean):
        torque = clean["driver_torque"]
        turned = replace(torque, values=np.where(torque.time > 210.0, -torque.values, torque.values))
        log = replace(holed(clean.with_signals(turned), "driver_torque", (200.0, 220.0)), source="laps")
        said = [f.text for f in driver_findings(identify_driver(log, asked=("anticipation",))) if f.severity == "bad"]
        assert any(text.startswith("laps, 220.0 to ") and "against the wheel's angle" in text for text in said)
        assert not any(text.startswith("laps, 0.0 to ") for text in said)


class TestRefused:
    def test_no_piece_is_long_enough(self, clean):
        torque = clean["driver_torque"]
        holes = [(a, a + 5.0) for a in np.arange(50.0, torque.time[-1], 50.0)]
        with pytest.raises(LogError, match=r"holes, the longest 5\.0 s at .*no piece.*shorter than 60 s") as error:
            drive_pieces(holed(clean, "driver_torque", *holes), 6.0, 1.3)
        assert "and 8 more" in error.value.found

    def test_a_signal_that_is_slow_everywhere(self, clean):
        bend = clean["road_curvature"]
        slow = replace(bend, time=bend.time[::100], values=bend.values[::100])
        with pytest.raises(LogError, match=r"road_curvature has \d+ holes, the longest 1\.0 s.*none is left"):
            drive_pieces(clean.with_signals(slow), 6.0, 1.3)

    def test_the_dual_filter_takes_one_piece(self, clean):
        known, log = TwoPointDriver(), holed(clean, "driver_torque", (200.0, 220.0))
        with pytest.raises(LogError, match=r"hole of 20\.0 s at 200\.0 s"):
            identify_driver(log, known, by="dual-ekf")

    def test_a_record_alone_is_not_cut(self, clean):
        with pytest.raises(LogError, match="none above"):
            driver_record(holed(clean, "driver_torque", (200.0, 220.0)), 6.0, 1.3)

    @pytest.mark.parametrize(
        ("gone", "said"),
        [
            (("lateral_offset", "heading_error", "sideslip_angle", "yaw_rate"),
             "lacks lateral_offset and heading_error (or else sideslip_angle and yaw_rate)"),
            (("road_curvature", "heading_error", "yaw_rate"), "lacks road_curvature, heading_error (or else yaw_rate)"),
            (("driver_torque", "heading_error"), "lacks driver_torque"),
        ],
    )  # fmt: skip
    def test_every_missing_signal_is_named(self, clean, gone, said):
        with pytest.raises(MissingSignal) as error:
            identify_driver(clean.without(*gone))
        assert error.value.found.endswith(said)
        assert "names.toml" in error.value.do


def test_signals_with_the_same_holes_are_told_together() -> None:
    holes = [Hole(name, start, start + 2.0) for name in "ab" for start in (1.0, 5.0)]
    assert holes_told([*holes, Hole("c", 1.0, 4.0)]) == (
        "a, b have 2 holes, the longest 2.0 s at 1.0 s; c has a hole of 3.0 s at 1.0 s"
    )


def test_holes_and_what_is_between() -> None:
    stamps = {"a": np.array([0.0, 0.5, 3.0, 9.0]), "b": np.array([-1.0, 1.0, 1.2, 8.5])}
    assert holes_of(stamps) == (Hole("a", 0.5, 3.0), Hole("a", 3.0, 9.0), Hole("b", -1.0, 1.0), Hole("b", 1.2, 8.5))
    holes = [Hole("a", 2.0, 3.0), Hole("b", 2.5, 4.0), Hole("a", 6.0, 12.0)]
    assert between(holes, (0.0, 10.0)) == [(0.0, 2.0), (4.0, 6.0)]
    assert between([], (0.0, 10.0)) == [(0.0, 10.0)]
