"""CSV and Parquet: what loggers and tools really write."""

import gzip
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from codriver import errors
from codriver.logs import open_recording, read
from codriver.logs.csv_layout import unique
from codriver.logs.names_file import NamesFile, parse_names
from codriver.logs.recording import RawSignal
from codriver.signals import Log

TIME = np.arange(5) * 0.1


def load(folder: Path, text: str | bytes, name: str = "drive.csv") -> tuple[dict[str, RawSignal], list[str]]:
    """All channels of a file with this text, and the faults."""
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    recording = open_recording(path)
    return recording.load(recording.channels()), recording.faults


PLAIN = "time,speed [km/h],gear\n0,36,1\n0.1,37.5,1\n0.2,39,2\n"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        "\ufeff" + PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", ";").replace(".", ","),
        "# made by a logger\n# on a Tuesday\n\n" + PLAIN,
        "sep=;\n" + PLAIN.replace(",", ";"),
        PLAIN.replace("2\n", "2,\n").replace("1\n", "1,\n"),
        PLAIN.replace("time", "Time [s]"),
        PLAIN.replace("0.1", "100").replace("0.2", "200").replace("time", "t [ms]"),
        PLAIN.replace("0.1", "100.0").replace("0.2", "200.0").replace("time", "t_ms"),
        PLAIN.replace("[km/h]", "(km/h)"),
        PLAIN.replace("speed [km/h]", "speed").replace("gear\n", "gear\ns,km/h,-\n"),
        PLAIN.replace("time,", "# time,").replace(" [km/h]", " [km/h]"),
        '"time","speed [km/h]","gear"\n"0","36","1"\n"0.1","37.5","1"\n"0.2","39","2"\n',
        PLAIN.encode("utf-16"),
        PLAIN.rstrip("\n"),
    ],
    ids=[
        "plain", "bom", "crlf", "tab", "decimal comma", "comments", "sep line", "separator at the end", "unit of time",
        "ms", "ms suffix", "round brackets", "row of units", "savetxt", "quoted", "utf-16", "no newline at the end",
    ],
)  # fmt: skip
def test_dialects(tmp_path: Path, text: str | bytes) -> None:
    signals, faults = load(tmp_path, text)
    speed = next(signal for name, signal in signals.items() if name.startswith("speed"))
    assert speed.unit == "km/h"
    np.testing.assert_allclose(speed.time, [0, 0.1, 0.2])
    np.testing.assert_allclose(speed.values, [36, 37.5, 39])
    np.testing.assert_allclose(signals["gear"].values, [1, 1, 2])
    assert not faults


def test_latin_1_and_a_degree_sign_encoded_twice(tmp_path: Path) -> None:
    signals, _ = load(tmp_path, "time;Öltemperatur [°C]\n0;80\n1;81\n".encode("latin-1"))
    assert signals["Öltemperatur [°C]"].unit == "°C"
    signals, _ = load(tmp_path, "time;oil [Â°C]\n0;80\n1;81\n")
    assert signals["oil [°C]"].unit == "°C"


def test_empty_cells_are_no_samples(tmp_path: Path) -> None:
    signals, faults = load(tmp_path, "time,fast,slow\n0.0,1,10\n0.1,2,\n0.2,3,NA\n0.3,4,20\n")
    assert signals["fast"].time.size == 4
    np.testing.assert_allclose(signals["slow"].time, [0, 0.3])
    np.testing.assert_allclose(signals["slow"].values, [10, 20])
    assert not faults


def test_a_column_whose_first_megabytes_are_empty(tmp_path: Path) -> None:
    rows = "".join(f"{k / 100:.2f},{k},\n" for k in range(60_000))
    signals, _ = load(tmp_path, "time,a,late\n" + rows + "600.00,1,0.5\n")
    np.testing.assert_allclose(signals["late"].time, [600.0])
    np.testing.assert_allclose(signals["late"].values, [0.5])


def test_nan_is_a_sample_unless_it_fills_up(tmp_path: Path) -> None:
    signals, _ = load(tmp_path, "time,a,b\n0,1,1\n1,nan,nan\n2,3,nan\n3,4,2\n4,5,3\n")
    assert np.isnan(signals["a"].values).sum() == 1
    np.testing.assert_allclose(signals["b"].time, [0, 3, 4])


@pytest.mark.parametrize(("unit", "count"), [("ms", 1000), ("us", 10**6), ("ns", 10**9)])
def test_integer_clocks_are_guessed_and_told(tmp_path: Path, unit: str, count: int) -> None:
    start = 1_479_426_201 * count
    rows = "".join(f"{start + k * count // 50},{k}\n" for k in range(10))
    signals, faults = load(tmp_path, "timestamp,x\n" + rows)
    np.testing.assert_allclose(signals["x"].time - 1_479_426_201, np.arange(10) / 50, atol=3e-7)
    assert f"taken as {unit}" in faults[0]


def test_integer_seconds_stay_seconds(tmp_path: Path) -> None:
    signals, faults = load(tmp_path, "time,x\n0,1\n1,2\n2,3\n")
    np.testing.assert_allclose(signals["x"].time, [0, 1, 2])
    assert not faults


@pytest.mark.parametrize(
    ("cells", "steps"),
    [
        (["2016-11-17 23:13:59.139199216", "2016-11-17 23:13:59.189199216", "2016-11-17T23:14:00.13919"], [0.05, 0.95]),
        (["2016-11-17T23:13:59.5Z", "2016-11-17T23:14:00Z", "2016-11-17T23:14:01+00:00"], [0.5, 1.0]),
        (["23:59:59.900", "23:59:59.950", "00:00:00.050"], [0.05, 0.1]),
        (["7:39:53.870", "7:39:53.960", "10:00:00.0"], [0.09, 8406.04]),
    ],
)
def test_dates_and_times_of_day(tmp_path: Path, cells: list[str], steps: list[float]) -> None:
    signals, _ = load(tmp_path, "Time,x\n" + "".join(f"{cell},{k}\n" for k, cell in enumerate(cells)))
    np.testing.assert_allclose(np.diff(signals["x"].time), steps, atol=1e-5)


def test_text_columns_are_listed_and_left_out(tmp_path: Path) -> None:
    signals, faults = load(tmp_path, "time,file,x,on\n0,a.jpg,1,true\n1,b.jpg,2,False\n")
    assert set(signals) == {"x", "on"}
    np.testing.assert_allclose(signals["on"].values, [1, 0])
    assert "file" in faults[0]


def test_bad_cells_and_rows_are_left_out_and_told(tmp_path: Path) -> None:
    rows = "".join(f"{k / 10},{k},{k}\n" for k in range(3000))
    text = "time,x,y\n" + rows + "time,x,y\n300.0,oops,7\n300.1,2,3\n300.2,4"
    signals, faults = load(tmp_path, text)
    assert signals["x"].values[-1] == 2
    np.testing.assert_allclose(signals["y"].values[-2:], [7, 3])
    assert np.isnan(signals["y"].time).sum() == 0
    told = " ".join(faults)
    assert "2 cells" in told
    assert "1 row has too few" in told


def test_bare_names_find_headers_with_units(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time,speed [km/h],acc [m/s2],acc [g]\n0,36,1,0.1\n")
    loaded = open_recording(path).load(["speed", "acc", "nothing"])
    assert set(loaded) == {"speed"}
    assert loaded["speed"].unit == "km/h"


def test_standard_names_need_no_names_file(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time [s],longitudinal_speed (km/h),gear,driver_torque [N.m]\n0,36,1,2\n0.1,72,2,2\n")
    log = read(path)
    np.testing.assert_allclose(log["longitudinal_speed"].values, [10, 20])
    assert set(log) == {"longitudinal_speed", "gear", "driver_torque"}


def test_stamps_since_1970_are_fresh_on_every_tick(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time,gear\n" + "".join(f"{1_700_000_000.123456 + k / 100:.6f},1\n" for k in range(5000)))
    assert read(path).sample(["gear"], 0.01).fresh["gear"].all()


class TestNamesakes:
    """Two columns of one name: the first is taken, and it is told where the other one says something else."""

    TOLD = "is taken, and the recording has"
    NAMES = parse_names('[longitudinal_speed]\nsource = "speed"\nunit = "m/s"\n', "n")

    def read(self, path: Path, headers: tuple[str, str], second: float, names: NamesFile | None = None) -> Log:
        if path.suffix == ".parquet":
            arrays = [pa.array(TIME), pa.array(TIME), pa.array(second * TIME)]
            pq.write_table(pa.Table.from_arrays(arrays, names=["time", *headers]), path)
        else:
            rows = "".join(f"{t},{t},{second * t}\n" for t in TIME)
            path.write_text(f"time,{','.join(headers)}\n{rows}")
        return read(path, names=names)

    @pytest.mark.parametrize("name", ["d.csv", "d.parquet"])
    @pytest.mark.parametrize(
        ("headers", "second", "other", "mapped"),
        [
            (("longitudinal_speed", "longitudinal_speed"), 2, "longitudinal_speed#2", False),
            (("longitudinal_speed", "longitudinal_speed"), 1, "", False),
            (("longitudinal_speed [m/s]", "longitudinal_speed [km/h]"), 1, "longitudinal_speed [km/h]", False),
            (("longitudinal_speed [m/s]", "longitudinal_speed [km/h]"), 3.6, "", False),
            (("speed", "speed"), 2, "speed#2", True),
            (("speed", "speed"), 1, "", True),
            (("speed [m/s]", "speed [m/s]"), 2, "speed [m/s]#2", True),
            (("speed", "speed [km/h]"), 2, "", True),  # the names file says which
        ],
    )
    def test_columns(self, tmp_path, name, headers, second, other, mapped) -> None:
        log = self.read(tmp_path / name, headers, second, self.NAMES if mapped else None)
        np.testing.assert_allclose(log["longitudinal_speed"].values, TIME)
        told = [fault for fault in log.faults if self.TOLD in fault]
        assert len(told) == bool(other)
        assert all(
            f"'{headers[0]}' {self.TOLD} '{other}' of the same name with other values" in fault for fault in told
        )

    def test_the_second_can_be_asked_for(self, tmp_path) -> None:
        names = parse_names('[longitudinal_speed]\nsource = "speed#2"\nunit = "m/s"\n', "n")
        for name in ("d.csv", "d.parquet"):
            log = self.read(tmp_path / name, ("speed", "speed"), 2, names)
            np.testing.assert_allclose(log["longitudinal_speed"].values, 2 * TIME)
            assert not [fault for fault in log.faults if self.TOLD in fault]

    def test_names_stay_different(self) -> None:
        assert unique(["a", "a#2", "a", "", "a"]) == ("a", "a#2", "a#3", "column 4", "a#4")

    def test_a_source_listed_twice(self) -> None:
        with pytest.raises(errors.NamesError, match="lists 'speed' more than once"):
            parse_names('[longitudinal_speed]\nsource = ["speed", "speed"]\n', "n")


def test_gzip_whole_and_cut_off(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    text = "time,x\n" + "".join(f"{k / 100},{x}\n" for k, x in enumerate(rng.normal(size=5000)))
    packed = gzip.compress(text.encode())
    signals, faults = load(tmp_path, packed, "drive.csv.gz")
    assert signals["x"].values.size == 5000
    assert not faults
    joined = gzip.compress(text[:20000].encode()) + gzip.compress(text[20000:].encode())
    signals, faults = load(tmp_path, joined, "joined.csv.gz")
    assert signals["x"].values.size == 5000
    assert not faults
    signals, faults = load(tmp_path, packed[:-3000], "cut.csv.gz")
    assert 1000 < signals["x"].values.size < 5000
    assert "cut off" in faults[0]


@pytest.mark.parametrize(
    ("text", "kind", "says"),
    [
        ("", errors.FormatError, "empty"),
        ("time,x\n", errors.LogError, "no rows"),
        ("1,2\n3,4\n", errors.LogError, "first row is numbers"),
        ("speed,x\n1,2\n", errors.LogError, "no time column; its columns are: speed, x"),
        ("# nothing\n", errors.LogError, "comment lines only"),
        (b"\0\1\2\3" * 10, errors.FormatError, "binary"),
        ("time,x\nsoon,1\nlater,2\n", errors.LogError, "no time"),
    ],
)
def test_what_cannot_be_read(tmp_path: Path, text: str | bytes, kind: type[errors.LogError], says: str) -> None:
    with pytest.raises(kind, match=says):
        load(tmp_path, text)


ROWS = "speed,roll_rate\n1.5,0.1\n1.6,0.2\n1.7,0.3\n"
RATED = '[time]\nrate = 50\n[longitudinal_speed]\nsource = "speed"\nunit = "m/s"\n'


class TestWithoutATimeColumn:
    """The names file says how many rows a second there are."""

    @pytest.mark.parametrize("name", ["drive.csv", "drive.txt", "drive.log", "drive.csv.gz", "drive.log.gz"])
    def test_rows_are_ticks(self, tmp_path: Path, name: str) -> None:
        raw = gzip.compress(ROWS.encode()) if name.endswith(".gz") else ROWS.encode()
        (tmp_path / name).write_bytes(raw)
        log = read(tmp_path / name, names=parse_names(RATED, "n.toml"))
        assert log["longitudinal_speed"].time == pytest.approx([0, 0.02, 0.04])
        assert log["longitudinal_speed"].values == pytest.approx([1.5, 1.6, 1.7])
        assert not log.faults

    def test_parquet(self, tmp_path: Path) -> None:
        path = parquet(tmp_path, pa.table({"speed": TIME}))
        (tmp_path / "n.toml").write_text(RATED)
        log = read(path, names=tmp_path / "n.toml")
        assert log["longitudinal_speed"].time == pytest.approx(np.arange(5) / 50)

    def test_empty_cells_and_short_rows(self, tmp_path: Path) -> None:
        """An empty cell is no sample; a row that cannot be read shifts those behind it, which is told."""
        (tmp_path / "a.csv").write_text(ROWS.replace("1.6,", ","))
        log = read(tmp_path / "a.csv", names=parse_names(RATED, "n"))
        assert log["longitudinal_speed"].time == pytest.approx([0, 0.04])
        (tmp_path / "b.csv").write_text(ROWS.replace("1.6,0.2", "1.6,0.2,7,8"))
        log = read(tmp_path / "b.csv", names=parse_names(RATED, "n"))
        assert log["longitudinal_speed"].time == pytest.approx([0, 0.02])
        assert "all rows behind come 0.02 s early" in log.faults[0]

    def test_a_time_column_counts_more(self, tmp_path: Path) -> None:
        (tmp_path / "a.csv").write_text("time,speed\n5,1\n6,2\n")
        log = read(tmp_path / "a.csv", names=parse_names(RATED, "n"))
        assert log["longitudinal_speed"].time == pytest.approx([5, 6])
        assert "50 rows a second, which is not used: time is the column 'time'" in log.faults[0]

    @pytest.mark.parametrize(
        "rate", ["rate = 0", "rate = true", 'rate = "100"', "rate = inf", "rate = 100\nunit = 'Hz'", ""]
    )
    def test_what_is_no_rate(self, rate: str) -> None:
        with pytest.raises(errors.NamesError, match=r"\[time\] holds rate alone"):
            parse_names(RATED.replace("rate = 50", rate), "n")

    def test_without_a_rate_it_is_asked_for(self, tmp_path: Path) -> None:
        (tmp_path / "a.log").write_text(ROWS)
        with pytest.raises(errors.LogError, match=r"\[time\] rate = 100"):
            read(tmp_path / "a.log")

    def test_a_trace_stays_a_trace(self, tmp_path: Path) -> None:
        (tmp_path / "a.log").write_text("(1.500000) can0 123#01020304\n(1.600000) can0 123#01020304\n")
        with pytest.raises(errors.LogError, match="raw CAN trace of 2 frames"):
            open_recording(tmp_path / "a.log")
        (tmp_path / "b.log").write_text("started\nstopped, at last\n")
        with pytest.raises(errors.FormatError, match="no CAN data frames"):
            open_recording(tmp_path / "b.log")


def parquet(folder: Path, table: pa.Table) -> Path:
    path = folder / "drive.parquet"
    pq.write_table(table, path)
    return path


def test_parquet_units_types_and_nulls(tmp_path: Path) -> None:
    fields = [
        pa.field("time", pa.int64(), metadata={"unit": "ms"}),
        pa.field("v", pa.float32(), metadata={"unit": "km/h", "comment": "wheel"}),
        pa.field("gear", pa.int8()),
        pa.field("brake", pa.bool_()),
        pa.field("note", pa.string()),
    ]
    columns = [[0, 100, 200], [1.5, None, 2.5], [1, 2, None], [True, False, True], ["a", "b", "c"]]
    path = parquet(tmp_path, pa.table(columns, schema=pa.schema(fields)))
    recording = open_recording(path)
    assert recording.channels()["v"].comment == "wheel"
    signals = recording.load(recording.channels())
    assert set(signals) == {"v", "gear", "brake"}
    np.testing.assert_allclose(signals["v"].time, [0, 0.2])
    np.testing.assert_allclose(signals["gear"].values, [1, 2])
    np.testing.assert_allclose(signals["brake"].values, [1, 0, 1])
    assert "note" in recording.faults[0]
    assert recording.load(["no such"]) == {}


def test_parquet_dates_as_the_index(tmp_path: Path) -> None:
    stamps = pa.array(np.datetime64("2024-01-01T00:00:00", "us") + np.arange(3) * np.timedelta64(10, "ms"))
    path = parquet(tmp_path, pa.table({"a.b": [1.0, 2.0, 3.0], "__index_level_0__": stamps}))
    signal = open_recording(path).load(["a.b"])["a.b"]
    np.testing.assert_allclose(np.diff(signal.time), 0.01, atol=1e-6)
    assert signal.time[0] == 1704067200.0


def test_parquet_that_is_none(tmp_path: Path) -> None:
    path = parquet(tmp_path, pa.table({"time": TIME, "x": TIME}))
    whole = path.read_bytes()
    path.write_bytes(whole[:-20])
    with pytest.raises(errors.FormatError, match="no Parquet file"):
        open_recording(path)
    parquet(tmp_path, pa.table({"time": TIME[:0], "x": TIME[:0]}))
    with pytest.raises(errors.LogError, match="no rows"):
        open_recording(path)
    parquet(tmp_path, pa.table({"x": TIME}))
    with pytest.raises(errors.LogError, match="no time column"):
        open_recording(path)
