"""Writers: what is written is read back, and nothing half-written stays."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from codriver import errors
from codriver.logs import open_recording
from codriver.logs.write import SUFFIXES, Column, check_output, complete_or_nothing, write_table

TIME = 1.7e9 + np.arange(200) * 0.01
COLUMNS = [
    Column("intentional_jerk", np.sin(TIME), "m/s^3", "time derivative"),
    Column("valid", np.arange(200) % 3 == 0),
    Column("gear", np.arange(200) // 50, "1"),
    Column('a "quoted", name', np.arange(200) / 7),
]
ABOUT = {"codriver.program": "jerk, 100 Hz", "vehicle": "clio"}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_round_trip(tmp_path: Path, suffix: str) -> None:
    if suffix == ".mf4":
        pytest.importorskip("asammdf")
    path = write_table(tmp_path / f"out{suffix}", TIME, COLUMNS, ABOUT)
    recording = open_recording(path)
    channels = recording.channels()
    assert len(channels) == len(COLUMNS)
    loaded = recording.load([column.name for column in COLUMNS])
    for column in COLUMNS:
        signal = loaded[column.name]
        np.testing.assert_array_equal(signal.values, column.values.astype(float))
        np.testing.assert_array_equal(signal.time, TIME)
        assert signal.unit == column.unit
    assert not recording.faults
    assert {p.name for p in tmp_path.iterdir()} <= {path.name, path.name + ".json"}


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_missing_values_are_empty_cells(tmp_path: Path, suffix: str) -> None:
    values = np.array([np.nan, 1.0, np.nan, 3.0, 4.0])
    path = write_table(tmp_path / f"out{suffix}", np.arange(5) / 10, [Column("x", values)])
    signal = open_recording(path).load(["x"])["x"]
    np.testing.assert_allclose(signal.time, [0.1, 0.3, 0.4])


def test_parquet_carries_what_there_is_to_say(tmp_path: Path) -> None:
    schema = pq.read_schema(write_table(tmp_path / "out.parquet", TIME, COLUMNS, ABOUT))
    assert schema.metadata[b"vehicle"] == b"clio"
    assert schema.field("intentional_jerk").metadata == {b"unit": b"m/s^3", b"comment": b"time derivative"}
    assert str(schema.field("valid").type) == "bool"


def test_csv_begins_with_its_header(tmp_path: Path) -> None:
    path = write_table(tmp_path / "out.csv", TIME, COLUMNS, ABOUT)
    with path.open(encoding="utf-8") as file:
        assert file.readline() == 'time [s],intentional_jerk [m/s^3],valid,gear [1],"a ""quoted"", name"\n'
    about = json.loads((tmp_path / "out.csv.json").read_text(encoding="utf-8"))
    assert about == {"metadata": ABOUT, "comments": {"intentional_jerk": "time derivative"}}
    write_table(tmp_path / "bare.csv", TIME, COLUMNS[1:])
    assert not (tmp_path / "bare.csv.json").exists()


def test_mf4_carries_what_there_is_to_say(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    path = write_table(tmp_path / "out.mf4", TIME, COLUMNS, ABOUT)
    with asammdf.MDF(path) as file:
        assert "vehicle: clio" in file.header.comment
        assert file.get("intentional_jerk").comment == "time derivative"


def test_no_rows_and_no_columns_can_be_written(tmp_path: Path) -> None:
    for suffix in (".parquet", ".csv"):
        assert write_table(tmp_path / f"none{suffix}", TIME[:0], [Column("x", TIME[:0])]).exists()
        assert write_table(tmp_path / f"bare{suffix}", TIME, []).exists()


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    assert check_output(tmp_path / "out.csv") == tmp_path / "out.csv"
    for path, says in (
        (tmp_path / "out.xlsx", "no format to write"),
        (tmp_path / "none" / "out.csv", "does not exist"),
        (tmp_path, "is a folder"),
    ):
        with pytest.raises(errors.UsageError, match=says):
            check_output(path)
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(errors.UsageError, match="is a folder"):
        check_output(tmp_path / "folder.csv")


def test_columns_must_fit(tmp_path: Path) -> None:
    with pytest.raises(errors.UsageError, match="twice: x"):
        write_table(tmp_path / "out.csv", TIME, [Column("x", TIME), Column("x", TIME)])
    with pytest.raises(errors.UsageError, match="twice: time"):
        write_table(tmp_path / "out.csv", TIME, [Column("time", TIME)])
    with pytest.raises(errors.UsageError, match="shape"):
        write_table(tmp_path / "out.csv", TIME, [Column("x", TIME[1:])])


def test_failure_leaves_nothing_and_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    path.write_text("old")

    def write_half(cause: BaseException) -> None:
        with complete_or_nothing(path) as draft:
            draft.write_text("half")
            raise cause

    with pytest.raises(errors.LogError, match="No space"):
        write_half(OSError(28, "No space left on device"))
    with pytest.raises(KeyboardInterrupt):
        write_half(KeyboardInterrupt())
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]
    assert path.read_text() == "old"
    with pytest.raises((errors.CodriverError, TypeError, ValueError)):
        write_table(path, TIME, [Column("x", np.array([object()] * 200))])
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]


def test_pandas_is_not_woken(tmp_path):
    """Arrow imports pandas for nothing unless it is given bytes; half a second of every first estimate."""
    program = (
        "import sys, numpy as np; from codriver.logs.write import Column, write_table; "
        "values = np.array([1.0, np.nan, 3.0]); flags = np.array([True, False, True]); "
        f"write_table({str(tmp_path / 'a.parquet')!r}, np.arange(3.0), [Column('x', values), Column('f', flags)]); "
        "sys.exit('pandas' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
