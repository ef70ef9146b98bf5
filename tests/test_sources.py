"""From a source's channels to a standard signal, from a recording and from a live bus alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import codriver as cd
from codriver.errors import NamesError
from codriver.live import BusDecoder
from codriver.logs.clock import mend_clock
from codriver.logs.mend import drop_codes, find_faults
from codriver.logs.names_file import parse_names
from codriver.logs.wording import counted

DBC = """VERSION ""
BU_: X
BO_ 256 Left: 2 X
 SG_ Speed : 0|16@1+ (0.01,0) [0|655] "km/h" X
BO_ 257 Right: 2 X
 SG_ Speed : 0|16@1+ (0.01,0) [0|655] "km/h" X
BO_ 259 Odd: 1 X
 SG_ Bare : 0|4@1+ (1,0) [0|15] "" X
 SG_ Miles : 4|4@1+ (1,0) [0|15] "mph" X
BO_ 258 Box: 1 X
 SG_ Gear : 0|4@1+ (1,0) [0|15] "" X
 SG_ Ready : 4|1@1+ (1,0) [0|1] "" X
"""
LEFT, RIGHT, BOX, ODD = 256, 257, 258, 259
Frame = tuple[float, int, bytes]
MEAN = '[longitudinal_speed]\nsource = ["Left.Speed", "Right.Speed"]\n'


def speed(metres_per_second: float) -> bytes:
    return round(metres_per_second * 360).to_bytes(2, "little")


def each(identifier: int, stamps: np.ndarray, payload: bytes) -> list[Frame]:
    return [(round(float(t), 6), identifier, payload) for t in stamps]


@pytest.fixture
def both(tmp_path: Path):
    """Frames through `read` and through `BusDecoder`: the log, and what live gives by name as (times, values)."""

    def call(frames: list[Frame], names: str) -> tuple[cd.Log, dict[str, np.ndarray]]:
        frames = sorted(frames)
        (tmp_path / "car.dbc").write_text(DBC)
        lines = [f"({t:.6f}) can0 {i:03X}#{payload.hex().upper()}\n" for t, i, payload in frames]
        (tmp_path / "drive.log").write_text("".join(lines))
        mapping = parse_names(names, "names.toml")
        log = cd.read(tmp_path / "drive.log", dbc=tmp_path / "car.dbc", names=mapping)
        decoder = BusDecoder(tmp_path / "car.dbc", mapping)
        live: dict[str, list[tuple[float, float]]] = {}
        for t, i, payload in frames:
            for name, value in decoder.decode(i, payload, t):
                live.setdefault(name, []).append((t, value))
        return log, {name: np.array(pairs).T for name, pairs in live.items()}

    return call


def alike(log: cd.Log, live: dict[str, np.ndarray]) -> None:
    """Both have the same numbers at the same times."""
    assert set(log) == set(live)
    for name, signal in log.items():
        there = np.isfinite(signal.values)
        np.testing.assert_array_equal(live[name], [signal.time[there], signal.values[there]])


class TestMean:
    def test_a_dead_source_does_not_pull_it(self, both):
        t = np.arange(0, 30, 0.1)
        frames = each(LEFT, t, speed(10)) + each(RIGHT, t[:100] + 0.01, speed(0))
        log, live = both(frames, MEAN)
        alike(log, live)
        mean = log["longitudinal_speed"]
        np.testing.assert_allclose(mean.values[(mean.time > 0.05) & (mean.time < 10.4)], 5)
        np.testing.assert_allclose(mean.values[mean.time > 10.45], 10)
        assert (
            "longitudinal_speed (Right.Speed): silent from 9.91 to 29.90 s; the mean is taken without it" in log.faults
        )

    def test_a_source_that_comes_back(self, both):
        t = np.arange(0, 30, 0.1)
        right = t[(t < 5) | ((t > 8) & (t < 12)) | (t > 20)] + 0.01
        log, live = both(each(LEFT, t, speed(10)) + each(RIGHT, right, speed(0)), MEAN)
        alike(log, live)
        assert any("silent 2 times, the longest from 11.91 to 20.11 s" in fault for fault in log.faults)
        assert log["longitudinal_speed"].values[-1] == pytest.approx(5)

    def test_a_slow_source_is_held_in_silence(self, both):
        log, live = both(
            each(LEFT, np.arange(0, 20, 0.02), speed(10)) + each(RIGHT, np.arange(0.01, 20, 0.4), speed(8)), MEAN
        )
        alike(log, live)
        assert not log.faults
        assert log["longitudinal_speed"].values[1:] == pytest.approx(9)

    def test_a_source_that_never_spoke(self, both):
        log, live = both(each(LEFT, np.arange(0, 20, 0.1), speed(10)), MEAN)
        alike(log, live)
        assert any("no channel 'Right.Speed'" in fault for fault in log.faults)

    def test_a_code_of_one_source_does_not_hide_in_it(self, both):
        """655.35 km/h and 36 km/h have a mean that a car can drive."""
        t = np.arange(0, 20, 0.1)
        right = each(RIGHT, t - 0.01 + 0.02, speed(10))
        right[50] = (right[50][0], RIGHT, b"\xff\xff")
        log, _ = both(each(LEFT, t, speed(10)) + right, MEAN)
        assert log["longitudinal_speed"].values == pytest.approx(10)
        assert any("Right.Speed): 1 of 200 values are 182.042 m/s" in fault for fault in log.faults)


class TestCodes:
    def test_a_code_is_left_out_live_and_recorded(self, both):
        """Gear 15 is no gear."""
        box = each(BOX, np.arange(0, 20, 0.1), b"\x03")
        box[50] = (box[50][0], BOX, b"\x0f")
        log, live = both(box, '[gear]\nsource = "Box.Gear"\n')
        alike(log, live)
        assert set(live["gear"][1]) == {3}
        assert any("15, out of -1 to 12" in fault for fault in log.faults)

    def test_a_code_of_one_source_counts_as_missing(self, both):
        t = np.arange(0, 20, 0.1)
        right = each(RIGHT, t + 0.01, speed(8))
        right[50:60] = [(stamp, RIGHT, b"\xff\xff") for stamp, _, _ in right[50:60]]
        log, live = both(each(LEFT, t, speed(10)) + right, MEAN)
        alike(log, live)
        assert set(np.round(log["longitudinal_speed"].values, 6)) == {9, 10}


class TestUnits:
    @pytest.mark.parametrize(
        ("table", "words"),
        [
            ('source = "Odd.Bare"', "(Odd.Bare): neither the source nor the names file gives its unit; taken as m/s"),
            ('source = "Odd.Bare"\nunit = "m/s"', ""),
            ('source = "Odd.Miles"', ""),
            ('source = ["Odd.Miles", "Left.Speed"]', ""),
            (
                'source = ["Odd.Miles", "Left.Speed"]\nunit = "km/h"',
                "units km/h, mph, and the names file takes all in km/h",
            ),
            ('source = ["Odd.Miles", "Left.Speed"]\noffset = 1', "offset = 1 is taken in each of them"),
        ],
    )
    def test_what_is_guessed_is_told(self, both, tmp_path, table, words):
        names = f"[longitudinal_speed]\n{table}\n"
        t = np.arange(0, 20, 0.1)
        log, _ = both(each(ODD, t, b"\x55") + each(LEFT, t, speed(2)), names)
        told = BusDecoder(tmp_path / "car.dbc", parse_names(names, "n")).faults
        assert list(log.faults) == told
        assert words in " ".join(told)
        assert bool(words) == bool(told)

    def test_numbers_without_a_unit_are_not_guessed(self, both):
        log, _ = both(each(BOX, np.arange(0, 20, 0.1), b"\x03"), '[gear]\nsource = "Box.Gear"\n')
        assert not log.faults

    def test_sources_of_different_units(self, both):
        t = np.arange(0, 20, 0.1)
        log, live = both(
            each(ODD, t, b"\x55") + each(LEFT, t - 0.01 + 0.02, speed(2)),
            '[longitudinal_speed]\nsource = ["Odd.Miles", "Left.Speed"]\n',
        )
        alike(log, live)
        assert log["longitudinal_speed"].values[-1] == pytest.approx((5 * 0.44704 + 2) / 2)


class TestValid:
    NAMES = MEAN + 'valid = "Box.Ready"\n'
    READY, NOT = b"\x10", b"\x00"

    def test_values_count_only_while_the_flag_is_up(self, both):
        t = np.arange(0, 20, 0.1)
        flags = each(BOX, np.array([2.05, 8.05]), self.READY) + each(BOX, np.array([6.05]), self.NOT)
        log, live = both(
            each(LEFT, t, speed(10)) + flags, '[longitudinal_speed]\nsource = "Left.Speed"\nvalid = "Box.Ready"'
        )
        alike(log, live)
        stamps = log["longitudinal_speed"].time
        np.testing.assert_allclose(stamps, t[((t > 2.05) & (t < 6.05)) | (t > 8.05)])
        assert (
            "longitudinal_speed (Left.Speed): 41 of 200 values left out, where Box.Ready is 0 or not there yet"
            in log.faults
        )
        assert "longitudinal_speed (Left.Speed): 1 gap, the longest 2.1 s at 6.00 s" in log.faults
        assert "Box.Ready" not in log.unmapped

    def test_in_the_frame_itself(self, both):
        """The flag of a frame counts for the values of that frame."""
        t = np.arange(0, 20, 0.1)
        frames = [(round(x, 6), BOX, b"\x13" if k % 10 else b"\x0f") for k, x in enumerate(t.tolist())]
        log, live = both(frames, '[gear]\nsource = "Box.Gear"\nvalid = "Box.Ready"\n')
        alike(log, live)
        assert set(log["gear"].values) == {3}
        assert len(log["gear"]) == 180

    def test_in_a_mean(self, both):
        t = np.arange(0, 20, 0.1)
        frames = each(LEFT, t, speed(10)) + each(RIGHT, t + 0.03, speed(8))
        flags = each(BOX, t[:100] + 0.01, self.READY) + each(BOX, t[100:] + 0.04, self.NOT)
        log, live = both(frames + flags, self.NAMES)
        alike(log, live)
        assert log["longitudinal_speed"].time[-1] == 10

    def test_a_flag_that_is_never_there(self, both):
        t = np.arange(0, 20, 0.1)
        text = '[longitudinal_speed]\nsource = "Left.Speed"\n[gear]\nsource = "Odd.Bare"\nvalid = "Box.Ready"\n'
        log, live = both(each(LEFT, t, speed(10)) + each(ODD, t, b"\x03"), text)
        alike(log, live)
        assert set(log) == {"longitudinal_speed"}
        assert any("gear: the recording has no channel 'Box.Ready'" in fault for fault in log.faults)

    def test_wrong_entries(self, tmp_path):
        with pytest.raises(NamesError, match="valid must be the name of a channel"):
            parse_names('[gear]\nsource = "Box.Gear"\nvalid = 1\n', "n")
        (tmp_path / "car.dbc").write_text(DBC)
        with pytest.raises(NamesError, match=r"Box\.No"):
            BusDecoder(tmp_path / "car.dbc", parse_names('[gear]\nsource = "Box.Gear"\nvalid = "Box.No"\n', "n"))


class TestClock:
    def test_two_drives_in_one_file_are_not_mixed(self, both_drives):
        """The second drive is the longer one; each was driven at a speed of its own."""
        log, told = both_drives
        speed = log["longitudinal_speed"]
        assert (speed.time[0], speed.time[-1]) == (0, 29.9)
        np.testing.assert_allclose(speed.values, 20)
        assert "the clock starts anew or leaps 1 time" in told
        assert "the longest run, 0 to 29.9 s, is kept; left out: 0 to 19.9 s" in told

    @pytest.fixture
    def both_drives(self, tmp_path):
        rows = [(t, 10.0) for t in np.arange(0, 20, 0.1)] + [(t, 20.0) for t in np.arange(0, 30, 0.1)]
        lines = "".join(f"{t:.3f},{v}\n" for t, v in rows)
        (tmp_path / "d.csv").write_text("time [s],longitudinal_speed [m/s]\n" + lines)
        log = cd.read(tmp_path / "d.csv")
        return log, " ".join(log.faults)

    def test_stamps_that_swapped_places_are_sorted(self):
        _, values, notes = mend_clock(np.array([0, 0.2, 0.1, 0.3]), np.array([0.0, 2, 1, 3]))
        np.testing.assert_array_equal(values, [0, 1, 2, 3])
        assert notes == ["time runs backwards once, by 0.1 s; samples sorted by time"]

    @pytest.mark.parametrize("stamp", [0.0, 500.0])
    def test_one_stamp_far_off_costs_one_sample(self, stamp):
        time = 10 + np.arange(100) / 10
        time[50] = stamp
        mended, _, notes = mend_clock(time, time)
        assert mended.size == 99
        assert notes == [f"1 sample with a stamp far from its neighbours' left out ({stamp:g} s)"]


class TestSharedClock:
    """Two drives joined in one file: the first is driven at 10 m/s in gear 1, the second at 20 m/s in gear 2."""

    DRIVES = ((60.0, 10.0, 1), (50.0, 20.0, 2))  # the first is kept
    NAMES = '[longitudinal_speed]\nsource = "Left.Speed"\n[gear]\nsource = "Box.Gear"\n'

    @pytest.mark.parametrize("late", [(2, 40), (None, 5), (50, None), (55, 2)])
    def test_columns_of_a_table(self, tmp_path, late):
        """The gear is told once or twice in each drive; alone it would keep the drive in which its stamps are further apart."""
        lines = []
        for (seconds, v, gear), first in zip(self.DRIVES, late, strict=True):
            told = () if first is None else (10 * first, 450)
            lines += [f"{k / 10:.1f},{v},{gear if k in told else ''}\n" for k in range(int(10 * seconds))]
        (tmp_path / "d.csv").write_text("time [s],longitudinal_speed [m/s],gear\n" + "".join(lines))
        log = cd.read(tmp_path / "d.csv")
        assert log["longitudinal_speed"].time[-1] == 59.9
        assert set(log["longitudinal_speed"].values) == {10.0}
        if late[0] is None:
            assert "gear" not in log
            assert "gear: there is no sample of it; it is left out" in log.faults
        else:
            assert set(log["gear"].values) == {1.0}
        anew = [fault for fault in log.faults if "starts anew" in fault]
        assert len(anew) == 1
        assert "time column 'time [s]': the clock starts anew or leaps 1 time" in anew[0]

    @pytest.mark.parametrize("bus", ["can0", "can1"])
    def test_messages_of_a_trace(self, tmp_path, bus):
        (tmp_path / "car.dbc").write_text(DBC)
        lines, sparse = [], ((2,), (5, 48))
        for (seconds, v, gear), told in zip(self.DRIVES, sparse, strict=True):
            frames = [(k / 10, "can0", LEFT, speed(v)) for k in range(int(10 * seconds))]
            frames += [(k + 0.05, bus, BOX, bytes([gear])) for k in told]
            lines += [f"({t:.6f}) {b} {i:03X}#{payload.hex().upper()}\n" for t, b, i, payload in sorted(frames)]
        (tmp_path / "d.log").write_text("".join(lines))
        log = cd.read(tmp_path / "d.log", dbc=tmp_path / "car.dbc", names=parse_names(self.NAMES, "n"))
        assert set(log["longitudinal_speed"].values) == {10.0}
        assert set(log["gear"].values) == {1.0}
        assert [f for f in log.faults if "the trace: the clock starts anew or leaps 1 time" in f]

    def test_buses_with_clocks_of_their_own(self, tmp_path):
        """Frames in turn, one bus 100 s ahead of the other: nothing is left out."""
        (tmp_path / "car.dbc").write_text(DBC)
        lines = []
        for k in range(300):
            lines.append(f"({k / 10:.6f}) can0 {LEFT:03X}#{speed(10).hex().upper()}\n")
            lines.append(f"({k / 10 + 100:.6f}) can1 {BOX:03X}#01\n")
        (tmp_path / "d.log").write_text("".join(lines))
        log = cd.read(tmp_path / "d.log", dbc=tmp_path / "car.dbc", names=parse_names(self.NAMES, "n"))
        assert (len(log["longitudinal_speed"]), len(log["gear"])) == (300, 300)
        assert not [fault for fault in log.faults if "anew" in fault]

    def test_columns_one_below_the_other(self, tmp_path):
        """As concatenated tables look: each column has its own rows, and none of them starts anew."""
        rows = [f"{k / 10:.1f},10,\n" for k in range(300)] + [f"{k / 10:.1f},,1\n" for k in range(200)]
        (tmp_path / "d.csv").write_text("time [s],longitudinal_speed [m/s],gear\n" + "".join(rows))
        log = cd.read(tmp_path / "d.csv")
        assert (len(log["longitudinal_speed"]), len(log["gear"])) == (300, 200)
        assert not [fault for fault in log.faults if "anew" in fault]

    def test_stamps_that_are_none_or_far_off(self, tmp_path):
        stamps = [f"{k / 10:.1f}" for k in range(300)]
        stamps[50], stamps[90] = "500.0", ""
        text = "".join(f"{t},{k},1\n" for k, t in enumerate(stamps))
        (tmp_path / "d.csv").write_text("time [s],longitudinal_speed [m/s],gear\n" + text)
        log = cd.read(tmp_path / "d.csv")
        assert sorted(set(range(300)) - set(log["longitudinal_speed"].values)) == [50, 90]
        told = " | ".join(log.faults)
        assert "time column 'time [s]': 1 sample with a stamp far from its neighbours' left out (500 s)" in told
        assert "1 sample without a time stamp left out" in told


def test_counts_read_as_words():
    assert counted(1, "gap") == "1 gap"
    assert counted(0, "gap") == "0 gaps"
    assert counted(2, "row", "has", "have") == "2 rows have"


def test_a_leap_of_the_clock_does_not_fill_the_memory():
    """A second of stamps 35 days ahead, and a half of another day: the run that fits is kept, and it is told."""

    time = np.arange(6000) / 100
    ahead = np.where((time >= 30) & (time < 31), time + 3e6, time)
    kept, _, notes = mend_clock(ahead, np.arange(6000.0))
    assert kept.size == 5900
    assert kept.max() < 60
    assert "leaps" in notes[0]
    days = np.where(time >= 40, time + 864000, time)
    kept, values, notes = mend_clock(days, np.arange(6000.0))
    assert values.tolist() == list(range(4000))
    assert "left out" in notes[0]


def test_single_samples_of_a_speed_that_leap():
    """One wrong sample is told with its size and place; braking hard, a quantised speed and a slow GPS are not."""
    t = np.arange(3000) / 100
    v = 20 - 12 * np.clip(t - 10, 0, 1.5)
    for values, time in ((v, t), (np.round(v / 0.4) * 0.4, t), (v[::100], t[::100])):
        assert find_faults(cd.Signal("longitudinal_speed", time, values, "m/s")) == []
    v[2000] += 5
    told = find_faults(cd.Signal("longitudinal_speed", t, v, "m/s"))
    assert "1 single sample stands out from the neighbours, by up to 5 m/s at 20.00 s" in told[0]


def test_absurd_values_are_missing():

    values = np.full(6000, 10.0)
    values[[100, 2000]] = 1e30, -4e9
    signal, notes = drop_codes(cd.Signal("longitudinal_speed", np.arange(6000) / 100, values, "m/s"))
    assert np.isnan(signal.values).sum() == 2
    assert "2 values of up to 1e+30 m/s" in notes[0]


def test_a_gap_is_no_stuck_sensor():
    t = np.arange(0, 60, 0.01)
    values = np.sin(t)
    there = (t < 20) | (t > 40)
    said = find_faults(cd.Signal("roll_rate", t[there], values[there], "rad/s"))
    assert len(said) == 1
    assert "1 gap, the longest 20 s" in said[0]
    values[2000:4000] = 0.1
    assert any(
        "shows one value for 20 s from 20.00 s" in text
        for text in find_faults(cd.Signal("roll_rate", t, values, "rad/s"))
    )
