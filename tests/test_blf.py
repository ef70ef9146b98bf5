"""BLF into columns: python-can writes and reads the same files, and hand-made objects show what it does not write."""

from __future__ import annotations

import random
import struct
import zlib

import can
import numpy as np
import pytest

from codriver.errors import FormatError
from codriver.logs.blf import parse_blf

START = 1.6e9


def messages(count, seed=0, *, fd=True, special=True):
    """Frames of all kinds, on two channels."""
    rng = random.Random(seed)
    made = []
    for k in range(count):
        is_fd = fd and rng.random() < 0.3
        length = rng.choice([0, 1, 7, 8, 12, 48, 64] if is_fd else range(9))
        extended = rng.random() < 0.5
        kind = rng.random() if special else 1.0
        made.append(
            can.Message(
                timestamp=START + k * 1e-3,
                arbitration_id=rng.randrange(1 << (29 if extended else 11)),
                is_extended_id=extended,
                is_fd=is_fd and kind > 0.1,
                is_remote_frame=kind < 0.05,
                is_error_frame=0.05 <= kind < 0.1,
                is_rx=rng.random() < 0.5,
                dlc=length if kind > 0.1 else 0,
                data=rng.randbytes(length) if kind > 0.1 else None,
                channel=rng.randrange(2),
            )
        )
    return made


def write(path, made, **options):
    with can.BLFWriter(str(path), **options) as writer:
        for message in made:
            writer.on_message_received(message)
    return path


def check(frames, path, offset=0):
    """The frames are those that python-can reads."""
    reader = can.BLFReader(str(path))
    expected = [m for m in reader if not (m.is_error_frame or m.is_remote_frame)]
    assert len(frames) == len(expected)
    np.testing.assert_allclose(frames.time, [m.timestamp - reader.start_timestamp for m in expected], rtol=0, atol=1e-6)
    np.testing.assert_array_equal(frames.bus, [m.channel + 1 for m in expected])
    np.testing.assert_array_equal(frames.identifier, [m.arbitration_id for m in expected])
    np.testing.assert_array_equal(frames.extended, [m.is_extended_id for m in expected])
    np.testing.assert_array_equal(frames.length, [len(m.data) for m in expected])
    for row, length, message in zip(frames.data, frames.length, expected, strict=True):
        assert row[:length].tobytes() == bytes(message.data)
        assert not row[length:].any()


@pytest.mark.parametrize("compression", [0, -1])
@pytest.mark.parametrize("container", [128 * 1024, 1000, 77])
@pytest.mark.parametrize("fd", [False, True])
def test_same_frames_as_python_can(tmp_path, compression, container, fd):
    made = messages(1500, fd=fd)
    path = write(tmp_path / "a.blf", made, compression_level=compression, max_container_size=container)
    frames, faults = parse_blf(path.read_bytes())
    check(frames, path)
    assert faults == []
    assert frames.data.shape[1] == (64 if fd else 8)


def test_blocks_join(tmp_path, monkeypatch):
    monkeypatch.setattr("codriver.logs.blf._BLOCK", 5000)
    path = write(tmp_path / "a.blf", messages(2000), max_container_size=3333)
    frames, faults = parse_blf(path.read_bytes())
    check(frames, path)
    assert faults == []


def test_objects_of_other_kinds_are_passed_over(tmp_path):
    path = tmp_path / "a.blf"
    with can.BLFWriter(str(path)) as writer:
        for k, message in enumerate(messages(300)):
            writer.on_message_received(message)
            writer.log_event("x" * (k % 7), message.timestamp)  # sizes that need padding
    frames, faults = parse_blf(path.read_bytes())
    check(frames, path)
    assert faults == []


def test_payload_that_spells_the_signature(tmp_path):
    made = messages(50, fd=False, special=False)
    for k in (10, 20, 49):
        made[k] = can.Message(timestamp=made[k].timestamp, arbitration_id=1, data=b"LOBJLOBJ", channel=0)
    path = write(tmp_path / "a.blf", made)
    frames, faults = parse_blf(path.read_bytes())
    check(frames, path)
    assert faults == []


def build(objects, *, told=None):
    """A BLF file with these objects in one container, nothing but the header's first fields filled in."""
    body = b"".join(objects)
    packed = zlib.compress(body)
    container = struct.pack("<4sHHLLH6xL4x", b"LOBJ", 16, 1, 32 + len(packed), 10, 2, len(body)) + packed
    container += bytes(len(packed) % 4)
    size = 144 + len(container)
    header = struct.pack("<4sL8xQ", b"LOGG", 144, size if told is None else told)
    return header + bytes(144 - len(header)) + container


def make_object(kind, body, *, stamp=0, flags=2, version=1):
    header = struct.pack("<LHHQ", flags, 0, 0, stamp) + (bytes(8) if version == 2 else b"")
    size = 16 + len(header) + len(body)
    return struct.pack("<4sHHLL", b"LOBJ", 16 + len(header), version, size, kind) + header + body + bytes(size % 4)


def fd_64(data, valid, *, flags=0x1000, extra=b"", end=0):
    return struct.pack("<BBBBLLLLLLLHBBL", 3, 15, valid, 0, 0x123, 0, flags, 0, 0, 0, 0, 0, 0, end, 0) + data + extra


def test_objects_that_python_can_does_not_write(tmp_path):
    can_2 = struct.pack("<HBBL8sLBBH", 2, 0, 3, 0x80000123, bytes(range(1, 9)), 0, 0, 0, 0)
    objects = [
        make_object(86, can_2, stamp=150, flags=1),  # 10 us
        make_object(86, can_2, stamp=2_000_000, version=2),
        make_object(101, fd_64(bytes(range(1, 13)), 12), stamp=3_000_000),
        make_object(101, fd_64(bytes(range(1, 5)), 12), stamp=4_000_000),  # tells of more bytes than it stores
        make_object(101, fd_64(bytes(range(1, 9)), 12, extra=b"\xff" * 8, end=80), stamp=5_000_000),
        make_object(101, fd_64(b"", 0, flags=0x10), stamp=6_000_000),  # remote
        make_object(115, b"text that is no frame", stamp=7_000_000),
        make_object(86, can_2, stamp=8_000_000, version=3),  # unknown header
        make_object(1, struct.pack("<HBBL8s", 1, 0, 15, 0x7FF, b"\xaa" * 8), stamp=9_000_000),  # DLC above 8
    ]
    content = build(objects)
    (tmp_path / "a.blf").write_bytes(content)
    frames, faults = parse_blf(content)
    assert faults == []
    np.testing.assert_allclose(frames.time, [1.5e-3, 2e-3, 3e-3, 4e-3, 5e-3, 9e-3])
    assert frames.bus.tolist() == [2, 2, 3, 3, 3, 1]
    assert frames.length.tolist() == [3, 3, 12, 12, 12, 8]
    assert frames.identifier.tolist() == [0x123] * 5 + [0x7FF]
    assert frames.extended.tolist() == [True, True, False, False, False, False]
    assert frames.data[0].tolist() == [1, 2, 3] + [0] * 61
    assert frames.data[3, :12].tolist() == [1, 2, 3, 4] + [0] * 8
    assert frames.data[4, :12].tolist() == [1, 2, 3, 4, 5, 6, 7, 8] + [0] * 4
    # python-can agrees on all it keeps; it takes a DLC above 8 for classic frames as it stands.
    read = [m for m in can.BLFReader(str(tmp_path / "a.blf")) if not m.is_remote_frame]
    for row, length, message in zip(frames.data[:5], frames.length, read, strict=False):
        assert row[:length].tobytes() == bytes(message.data)


@pytest.mark.parametrize("fraction", [0.3, 0.7, 0.999])
@pytest.mark.parametrize("compression", [0, -1])
def test_cut_file_gives_the_frames_before_the_cut(tmp_path, fraction, compression):
    path = write(tmp_path / "a.blf", messages(3000), max_container_size=20_000, compression_level=compression)
    content = path.read_bytes()
    whole, _ = parse_blf(content)
    frames, faults = parse_blf(content[: int(len(content) * fraction)])
    assert 0.9 * fraction < len(frames) / len(whole) < 1.1 * fraction
    np.testing.assert_array_equal(frames.time, whole.time[: len(frames)])
    np.testing.assert_array_equal(frames.data, whole.data[: len(frames)])
    assert len(faults) == 1
    assert "cut off" in faults[0]


def test_any_cut_reads(tmp_path):
    content = write(tmp_path / "a.blf", messages(40), max_container_size=600).read_bytes()
    before = 0
    for cut in range(8, len(content), 3):
        frames, faults = parse_blf(content[:cut])
        assert len(frames) >= before
        before = len(frames)
        assert faults


def test_file_that_was_never_closed(tmp_path):
    content = bytearray(write(tmp_path / "a.blf", messages(500)).read_bytes())
    whole, _ = parse_blf(bytes(content))
    content[16:24] = struct.pack("<Q", 144)  # as the header is before the logger closes the file
    frames, faults = parse_blf(bytes(content))
    assert len(frames) == len(whole)
    assert len(faults) == 1
    assert "did not close" in faults[0]


def test_damage_in_the_middle_loses_only_what_is_damaged(tmp_path):
    path = write(tmp_path / "a.blf", messages(3000), max_container_size=10_000)
    content = bytearray(path.read_bytes())
    whole, _ = parse_blf(bytes(content))
    middle = len(content) // 2
    content[middle : middle + 40] = b"\xff" * 40
    frames, faults = parse_blf(bytes(content))
    assert len(whole) * 0.85 < len(frames) < len(whole)
    assert np.isin(frames.time, whole.time).all()
    assert any("damaged" in fault for fault in faults)


def test_random_damage_never_raises(tmp_path):
    content = write(tmp_path / "a.blf", messages(200), max_container_size=2000, compression_level=0).read_bytes()
    rng = random.Random(3)
    for _ in range(200):
        spoilt = bytearray(content)
        for _ in range(rng.randrange(1, 30)):
            spoilt[rng.randrange(32, len(spoilt))] = rng.randrange(256)
        parse_blf(bytes(spoilt))


@pytest.mark.parametrize("content", [b"", b"LOG", b"MDF     4.10", b"\0" * 1000])
def test_other_files_are_refused(content):
    with pytest.raises(FormatError, match="no BLF file"):
        parse_blf(content)


def test_reader_is_registered(tmp_path):
    from codriver.logs.registry import find_reader

    path = write(tmp_path / "A.BLF", messages(3))
    assert "BLF" in find_reader(path).title
