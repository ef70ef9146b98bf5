"""CAN traces in text, and one round trip over all formats: python-can writes and reads the same files."""

from __future__ import annotations

import gzip
import random
from typing import ClassVar

import can
import numpy as np
import pytest

from codriver.errors import FormatError, LogError
from codriver.logs import open_recording
from codriver.logs.blf import parse_blf
from codriver.logs.candump import parse_candump
from codriver.logs.text_traces import parse_asc, parse_trc


class RoundTrip:
    """What python-can writes, we read as python-can reads it. The flags say what the format can carry."""

    suffix: ClassVar[str]
    writer: ClassVar[type]
    reader: ClassVar[type]
    carries_fd = True
    carries_remote = True
    carries_error = True
    carries_channel = True
    checks_identifiers = True
    first_channel = 1  # ours, for python-can's channel 0
    from_start = True  # python-can's stamps less the first are ours
    resolution = 1e-6

    @staticmethod
    def parse(content):
        raise NotImplementedError

    def messages(self, count, seed, *, fd, special=True):
        rng = random.Random(seed)
        time = 1.6e9
        for _ in range(count):
            time += rng.choice([0.0, 1e-6, 0.001, 0.01, 1.0])
            extended, kind = rng.random() < 0.5, rng.random() if special else 1.0
            is_fd = fd and self.carries_fd and rng.random() < 0.4
            remote, error = kind < 0.05 and self.carries_remote, 0.05 <= kind < 0.1 and self.carries_error
            length = rng.choice([1, 5, 8, 12, 20, 64]) if is_fd else rng.randrange(9)
            plain = not (remote or error)
            yield can.Message(
                timestamp=time,
                arbitration_id=rng.randrange(1 << (29 if extended else 11)),
                is_extended_id=extended,
                is_fd=is_fd and plain,
                is_remote_frame=remote,
                is_error_frame=error,
                is_rx=rng.random() < 0.5,
                dlc=length if plain else 0,
                data=rng.randbytes(length) if plain else None,
                channel=rng.randrange(2) if self.carries_channel else 0,
            )

    def write(self, path, made):
        with self.writer(str(path)) as writer:
            for message in made:
                writer.on_message_received(message)
        return path

    @pytest.mark.parametrize("fd", [False, True])
    @pytest.mark.parametrize("seed", [1, 2])
    def test_same_frames_as_python_can(self, tmp_path, fd, seed):
        path = self.write(tmp_path / f"a{self.suffix}", list(self.messages(600, seed, fd=fd)))
        expected = [m for m in self.reader(str(path)) if not (m.is_error_frame or m.is_remote_frame)]
        frames, faults = self.parse(path.read_bytes())
        assert faults == []
        assert len(frames) == len(expected) > 400
        time = np.array([m.timestamp for m in expected])
        start = time[0] - frames.time[0] if self.from_start else 0.0
        np.testing.assert_allclose(frames.time, time - start, rtol=0, atol=self.resolution)
        np.testing.assert_array_equal(frames.identifier, [m.arbitration_id for m in expected])
        np.testing.assert_array_equal(frames.extended, [m.is_extended_id for m in expected])
        np.testing.assert_array_equal(frames.length, [len(m.data) for m in expected])
        for row, length, message in zip(frames.data, frames.length, expected, strict=True):
            assert row[:length].tobytes() == bytes(message.data)
            assert not row[length:].any()
        if self.carries_channel:
            assert set(frames.bus.tolist()) == {self.first_channel, self.first_channel + 1}

    def test_small_blocks_join(self, tmp_path, monkeypatch):
        path = self.write(tmp_path / f"a{self.suffix}", list(self.messages(300, 5, fd=True)))
        whole, _ = self.parse(path.read_bytes())
        monkeypatch.setattr("codriver.logs.text_tokens._BLOCK", 700)
        monkeypatch.setattr("codriver.logs.blf._BLOCK", 700)
        parts, faults = self.parse(path.read_bytes())
        assert faults == []
        for column in ("time", "bus", "identifier", "extended", "length", "data"):
            np.testing.assert_array_equal(getattr(parts, column), getattr(whole, column))

    def test_reads_through_the_registry_packed_or_not(self, tmp_path):
        dbc = tmp_path / "a.dbc"
        dbc.write_text('VERSION ""\nBU_:\nBO_ 256 Body: 8 X\n SG_ Speed : 0|16@1+ (0.5,-10) [0|0] "km/h" X\n')
        made = [
            can.Message(timestamp=1e9 + k, arbitration_id=256, is_extended_id=False, data=[k, 0] + [9] * 6, channel=0)
            for k in range(5)
        ]
        plain = self.write(tmp_path / f"a{self.suffix}", made)
        packed = tmp_path / f"b{self.suffix}.gz"
        packed.write_bytes(gzip.compress(plain.read_bytes()))
        for path in (plain, packed):
            recording = open_recording(path, dbc=dbc)
            assert list(recording.channels()) == ["Body.Speed"]
            signal = recording.load(["Body.Speed"])["Body.Speed"]
            np.testing.assert_array_equal(signal.values, np.arange(5) * 0.5 - 10)
            np.testing.assert_allclose(np.diff(signal.time), 1.0)
            assert signal.unit == "km/h"
        cut = tmp_path / f"c{self.suffix}.gz"
        cut.write_bytes(packed.read_bytes()[:-12])
        assert any("cut off" in fault for fault in open_recording(cut, dbc=dbc).faults)

    @pytest.mark.parametrize("content", [b"", b"\n\n", b"no trace at all\n" * 50, bytes(range(256)) * 20])
    def test_other_files_are_refused(self, tmp_path, content):
        path = tmp_path / f"a{self.suffix}"
        path.write_bytes(content)
        with pytest.raises(FormatError) as caught:
            open_recording(path)
        assert str(path) in str(caught.value)

    def test_spoilt_files_never_crash(self, tmp_path):
        content = self.write(tmp_path / f"a{self.suffix}", list(self.messages(60, 3, fd=True))).read_bytes()
        rng = random.Random(7)
        for _ in range(60):
            spoilt = bytearray(content)
            for _ in range(rng.randrange(1, 20)):
                spoilt[rng.randrange(32, len(spoilt))] = rng.randrange(256)
            frames, _ = self.parse(bytes(spoilt[: rng.randrange(40, len(spoilt))]))
            assert (frames.length <= frames.data.shape[1]).all()
            if self.checks_identifiers:
                assert (frames.identifier < np.where(frames.extended, 1 << 29, 1 << 11)).all()


class TestBlf(RoundTrip):
    suffix, writer, reader, parse = ".blf", can.BLFWriter, can.BLFReader, staticmethod(parse_blf)

    checks_identifiers = False  # the number and the flag for 29 bits are apart, and taken as they stand


class TestAsc(RoundTrip):
    suffix, writer, reader, parse = ".asc", can.ASCWriter, can.ASCReader, staticmethod(parse_asc)


class TestTrc(RoundTrip):
    suffix, writer, reader, parse = ".trc", can.TRCWriter, can.TRCReader, staticmethod(parse_trc)
    carries_fd = carries_remote = carries_error = False


class TestCandump(RoundTrip):
    suffix, writer, reader, parse = ".log", can.CanutilsLogWriter, can.CanutilsLogReader, staticmethod(parse_candump)
    from_start = False
    first_channel = 0


ASC = b"""date Wed Jan 1 10:00:00.000 am 2020
base %s  timestamps %s
internal events logged
// a comment
Begin Triggerblock Wed Jan 1 10:00:00.000 am 2020
   0.000000 Start of measurement
   0.100000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%%
   0.200000 1  100             Rx   d 3 10 20 30  Length = 240015 BitCount = 124
   0.300000 CAN 1 Status:chip status error active
   0.400000 2  100x            Tx   d 2 01 02
   0.500000 1  ErrorFrame
   0.600000 1  100             Rx   r 8
   0.700000 1  EngineData      Rx   d 1 07
   0.800000 1  100             TxRq d 1 07
   0.900000 CANFD  1 Rx        100  SomeName                         1 0 1 1 05 0 0 0
   1.000000 CANFD  1 Rx        100                                   1 0 %s 12 01 02 03 04 05 06 07 08 09 10 11 12 0 0
End TriggerBlock
"""


@pytest.mark.parametrize("base", ["hex", "dec"])
@pytest.mark.parametrize("stamps", ["absolute", "relative"])
def test_asc_bases_stamps_and_lines_of_other_kinds(base, stamps):
    content = ASC % (base.encode(), stamps.encode(), b"9")
    frames, faults = parse_asc(content)
    number = 0x100 if base == "hex" else 100
    assert frames.identifier.tolist() == [number] * 5
    assert frames.extended.tolist() == [False, True, False, False, False]
    assert frames.bus.tolist() == [1, 2, 1, 1, 1]
    assert frames.length.tolist() == [3, 2, 1, 1, 12]
    assert frames.data[0, :4].tolist() == ([0x10, 0x20, 0x30, 0] if base == "hex" else [10, 20, 30, 0])
    assert frames.data[4, 8:13].tolist() == ([9, 0x10, 0x11, 0x12, 0] if base == "hex" else [9, 10, 11, 12, 0])
    written = np.arange(11) / 10
    expected = written if stamps == "absolute" else np.cumsum(written)
    np.testing.assert_allclose(frames.time, expected[[2, 4, 8, 9, 10]])
    assert len(faults) == 1
    assert "1 line " in faults[0]
    assert "EngineData" in faults[0]


def test_asc_counts_lines_that_lack_bytes():
    frames, faults = parse_asc(
        b"0.1 1 100 Rx d 8 01 02\n0.2 1 100 Rx d 2 01 02\n0.3 1 100 Rx d 2 0G 02\n0.4 1 800 Rx d 0\n"
    )
    assert frames.time.tolist() == [0.2]
    assert "3 lines" in faults[0]


# Each version: a data frame, a line of another type, an extended frame without data, a remote frame.
TRC = {
    "1.0": b""";   Columns of version 1.0
     1)      10  0300  3 01 02 03
     2)      20  FFFFFFFF  4 00 00 00 04
     3)      30  00000300  0
     4)      40  0300  3 RTR
""",
    "1.1": b""";$FILEVERSION=1.1
;$STARTTIME=43000.5
     1)  10.0  Rx     0300      3  01 02 03
     2)  20.0  Warng  FFFFFFFF  4  00 00 00 04
     3)  30.0  Tx     00000300  0
     4)  40.0  Rx     0300      3  RTR
""",
    "1.2": b""";$FILEVERSION=1.2
;$STARTTIME=43000.5
     1)  10.0  1  Rx     0300      3  01 02 03
     2)  20.0  1  Warng  FFFFFFFF  4  00 00 00 04
     3)  30.0  1  Tx     00000300  0
     4)  40.0  1  Rx     0300      3  RTR
""",
    "1.3": b""";$FILEVERSION=1.3
;$STARTTIME=43000.5
     1)  10.0  1  Rx     0300      -  3  01 02 03
     2)  20.0  1  Warng  FFFFFFFF  -  4  00 00 00 04
     3)  30.0  1  Tx     00000300  -  0
     4)  40.0  1  Rx     0300      -  3  RTR
""",
    "2.0": b""";$FILEVERSION=2.0
;$STARTTIME=43000.5
;$COLUMNS=N,O,T,I,d,l,D
     1  10.0  DT  0300      Rx  3  01 02 03
     2  20.0  ST            Rx  00 00 00 08
     3  30.0  DT  00000300  Tx  0
     4  40.0  RR  0300      Rx  3
""",
    "2.1": b""";$FILEVERSION=2.1
;$STARTTIME=43000.5
;$COLUMNS=N,O,T,B,I,d,R,L,D
     1  10.0  DT  1  0300      Rx  -  3  01 02 03
     2  20.0  ER  1  -         Rx  -  5  00 00 00 08 01
     3  30.0  DT  1  00000300  Tx  -  0
     4  40.0  RR  1  0300      Rx  -  3
""",
}


@pytest.mark.parametrize("version", TRC)
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
def test_trc_versions(version, newline, tmp_path):
    content = TRC[version].replace(b"\n", newline)
    frames, faults = parse_trc(content)
    assert faults == []
    np.testing.assert_allclose(frames.time, [0.01, 0.03])
    assert frames.identifier.tolist() == [0x300, 0x300]
    assert frames.extended.tolist() == [False, True]
    assert frames.bus.tolist() == [1, 1]
    assert frames.length.tolist() == [3, 0]
    assert frames.data.tolist() == [[1, 2, 3, 0, 0, 0, 0, 0], [0] * 8]
    if version != "1.2":  # which python-can does not read
        path = tmp_path / "a.trc"
        path.write_bytes(content)
        read = [m for m in can.TRCReader(str(path)) if not m.is_remote_frame]
        assert [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in read] == [
            (0x300, False, b"\1\2\3"),
            (0x300, True, b""),
        ]


def test_trc_with_fd_frames():
    content = (
        b";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n1 1.5 FB 2 0123 Rx - 9 "
        + b"AB " * 12
        + b"\n2 2.5 DT 1 0123 Rx - 1 01\n"
    )
    frames, faults = parse_trc(content)
    assert faults == []
    assert frames.length.tolist() == [12, 1]
    assert frames.data[0].tolist() == [0xAB] * 12 + [0] * 52
    assert frames.bus.tolist() == [2, 1]


def test_candump_interfaces_and_frames_of_other_kinds():
    content = (
        b"(1436509052.249713) can0 123#01020304\n(1436509052.449713) vcan0 12345678#\n(1436509053.649713) can0 123#R\n"
        b"(1436509053.649713) can0 20000080#0000000000000000\n(1436509053.749713) can1 123##5" + b"AB" * 20 + b"\n"
        b"(1436509053.849713) can1 123#0102030405060708_9 T\n(1436509053.849713) can1 123#010\n"
        b"(1436509053.9) can1 123#\n"
    )
    frames, faults = parse_candump(content)
    assert frames.time.tolist() == [
        1436509052.249713,
        1436509052.449713,
        1436509053.749713,
        1436509053.849713,
        1436509053.9,
    ]
    assert frames.length.tolist() == [4, 0, 20, 8, 0]
    assert frames.extended.tolist() == [False, True, False, False, False]
    assert frames.bus.tolist() == [0, 1, 2, 2, 2]
    assert "1 line " in faults[0]
    assert "can0, vcan0, can1 are numbered 0, 1, 2" in faults[1]


def test_channels_are_those_of_the_interfaces_names():
    frames, faults = parse_candump(b"(1.5) can3 123#01\n(2.5) can1 123#01\n")
    assert frames.bus.tolist() == [3, 1]
    assert faults == []


def test_no_database_says_what_is_in_the_trace(tmp_path):
    path = tmp_path / "a.log"
    path.write_bytes(b"(1.0) can0 123#01\n(2.0) can0 123#01\n(2.0) can0 18FEF100#01\n")
    with pytest.raises(LogError) as caught:
        open_recording(path)
    assert "0x123 (2 frames), 0x18FEF100x (1 frames)" in caught.value.found
    assert "--dbc" in caught.value.do
