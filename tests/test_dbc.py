"""Decoding columns of frames by a database: cantools decodes the same frames one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cantools.database import load_string
from cantools.database.can import Message
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from codriver.errors import LogError
from codriver.logs.can_bits import Layout, extract, take
from codriver.logs.can_recording import CanRecording
from codriver.logs.can_streams import find_streams
from codriver.logs.dbc import MessageLayout, load_database, parameter_group
from codriver.logs.frames import Frames

SHARED = Path(__file__).resolve().parents[1] / ".." / "shared" / "data"
QUICK = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: X\n'


def make_frames(identifiers, payloads, *, bus=None, extended=None, time=None, length=None):
    """Frames from lists; the length is that of each payload."""
    count = len(identifiers)
    sizes = [len(p) for p in payloads] if length is None else length
    data = np.zeros((count, 64 if max(sizes, default=0) > 8 else 8), np.uint8)
    for row, payload in zip(data, payloads, strict=True):
        row[: len(payload)] = np.frombuffer(bytes(payload), np.uint8)
    return Frames(
        np.arange(count, dtype=float) / 100 if time is None else np.asarray(time, float),
        np.asarray(bus if bus is not None else [1] * count, np.int16),
        np.asarray(identifiers, np.uint32),
        np.asarray(extended if extended is not None else [False] * count, bool),
        np.asarray(sizes, np.uint8),
        data,
    )


def record(tmp_path, dbc, frames, bus=None):
    path = tmp_path / "a.dbc"
    path.write_text(dbc if dbc.startswith("VERSION") else HEAD + dbc)
    return CanRecording("a.blf", "BLF, CAN trace", frames, path, bus, [])


@st.composite
def signals(draw, width):
    """A signal that fits into `width` bytes: its DBC line, and whether it is a float (and of how many bits)."""
    kind = draw(st.sampled_from(["+", "-", "float"]))
    length = draw(st.sampled_from([32, 64]) if kind == "float" else st.integers(1, min(64, 8 * width)))
    length = min(length, 8 * width)
    if kind == "float" and length not in (32, 64):
        kind = "+"
    first = draw(st.integers(0, 8 * width - length))  # the place of the first bit in the signal's own order of counting
    little = draw(st.booleans())
    start = first if little else 8 * (first // 8) + 7 - first % 8
    scale = draw(st.sampled_from(["1", "0.1", "-2", "0.0078125", "1E-005", "100"]))
    offset = draw(st.sampled_from(["0", "-40", "0.5", "1000"]))
    return start, length, little, kind, scale, offset


def line(name, spec, mux=""):
    start, length, little, kind, scale, offset = spec
    sign = "-" if kind == "-" else "+"
    return f' SG_ {name} {mux}: {start}|{length}@{int(little)}{sign} ({scale},{offset}) [0|0] "u" X\n'


def value_types(identifier, named):
    kinds = {"f32": 1, "f64": 2}
    return "".join(
        f"SIG_VALTYPE_ {identifier} {name} : {kinds[f'f{spec[1]}']};\n"
        for name, spec in named.items()
        if spec[3] == "float"
    )


def alone(message):
    """cantools' messages with one signal each: it cannot decode messages in which signals overlap."""
    return {s.name: Message(1, "Alone", message.length, [s], strict=False) for s in message.signals}


def same(ours, theirs):
    # cantools computes with whole numbers where it can, so beyond 53 bits it rounds once where floats round twice.
    np.testing.assert_allclose(ours, np.array(theirs, float), rtol=1e-15, atol=0, equal_nan=True)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # random bits make floats that overflow when scaled
@QUICK
@given(data=st.data(), width=st.sampled_from([1, 3, 8, 12, 64]))
def test_any_signal_of_any_message_decodes_as_cantools_does(tmp_path, data, width):
    named = {f"S{k}": spec for k, spec in enumerate(data.draw(st.lists(signals(width), min_size=1, max_size=6)))}
    text = HEAD + f"BO_ 291 M: {width} X\n" + "".join(line(n, s) for n, s in named.items()) + value_types(291, named)
    payloads = data.draw(st.lists(st.binary(min_size=width, max_size=width), min_size=1, max_size=5))
    payloads += [bytes(width), b"\xff" * width, bytes(range(1, width + 1))]
    recording = record(tmp_path, text, make_frames([291] * len(payloads), payloads))
    loaded = recording.load(recording.channels())
    assert set(loaded) == {f"M.{name}" for name in named}
    for name, oracle in alone(load_string(text, "dbc", strict=False).messages[0]).items():
        same(loaded[f"M.{name}"].values, [oracle.decode(p, decode_choices=False)[name] for p in payloads])
        np.testing.assert_array_equal(loaded[f"M.{name}"].time, recording.frames.time)


@QUICK
@given(data=st.data())
def test_short_frames_are_left_out_signal_by_signal(tmp_path, data):
    named = {f"S{k}": spec for k, spec in enumerate(data.draw(st.lists(signals(8), min_size=1, max_size=4)))}
    named = {name: (*spec[:3], "+", *spec[4:]) for name, spec in named.items()}
    text = HEAD + "BO_ 291 M: 8 X\n" + "".join(line(n, s) for n, s in named.items())
    payloads = data.draw(st.lists(st.binary(min_size=0, max_size=8), min_size=1, max_size=8))
    recording = record(tmp_path, text, make_frames([291] * len(payloads), payloads))
    loaded = recording.load(recording.channels())
    missing = 0
    for name, oracle in alone(load_string(text, "dbc", strict=False).messages[0]).items():
        decoded = [oracle.decode(p, decode_choices=False, allow_truncated=True) for p in payloads]
        same(loaded[f"M.{name}"].values, [d[name] for d in decoded if name in d])
        missing = max(missing, sum(name not in d for d in decoded))
    told = [fault for fault in recording.faults if "too short" in fault]
    assert len(told) == (missing > 0)
    if missing:
        assert f"{missing} of {len(payloads)} frames" in told[0]


EXTENDED = """BO_ 100 M: 8 X
 SG_ Outer M : 0|4@1+ (1,0) [0|0] "" X
 SG_ Inner m1M : 4|4@1+ (2,1) [0|0] "" X
 SG_ Plain : 8|8@1- (1,0) [0|0] "" X
 SG_ A m0 : 16|8@1+ (0.5,0) [0|0] "" X
 SG_ B m2 : 16|16@1+ (1,0) [0|0] "" X
 SG_ C m3 : 32|16@1- (1,0) [0|0] "" X
 SG_ D m5 : 48|16@1- (1,0) [0|0] "" X
SG_MUL_VAL_ 100 Inner Outer 1-1;
SG_MUL_VAL_ 100 A Outer 0-0, 4-6;
SG_MUL_VAL_ 100 B Outer 2-2;
SG_MUL_VAL_ 100 C Inner 3-4;
SG_MUL_VAL_ 100 D Inner 5-5;
"""


def test_multiplexers_behind_multiplexers(tmp_path):
    rng = np.random.default_rng(0)
    payloads = rng.integers(0, 256, (500, 8), dtype=np.uint8)
    payloads[:, 0] &= 0x77
    payloads = [p.tobytes() for p in payloads]
    recording = record(tmp_path, EXTENDED, make_frames([100] * 500, payloads))
    message = load_string(HEAD + EXTENDED, "dbc").get_message_by_name("M")
    loaded = recording.load(recording.channels())
    expected = {signal.name: [] for signal in message.signals}
    for time, payload in zip(recording.frames.time, payloads, strict=True):
        # Written out by hand: cantools refuses frames whose multiplexer selects nothing.
        outer, inner = payload[0] & 15, payload[0] >> 4
        carried = (
            {"Outer", "Plain"} | ({"Inner"} if outer == 1 else set()) | ({"A"} if outer in (0, 4, 5, 6) else set())
        )
        carried |= {"B"} if outer == 2 else set()
        carried |= {"C"} if outer == 1 and inner in (3, 4) else {"D"} if outer == 1 and inner == 5 else set()
        for name in carried:
            expected[name].append(time)
    for name, times in expected.items():
        assert times
        np.testing.assert_array_equal(loaded[f"M.{name}"].time, times)


@QUICK
@given(data=st.data())
def test_multiplexed_messages_decode_as_cantools_does(tmp_path, data):
    specs = data.draw(st.lists(signals(7), min_size=2, max_size=4))
    shifted = {f"S{k}": (s[0] + 8, s[1], s[2], "+", s[4], s[5]) for k, s in enumerate(specs)}
    text = HEAD + 'BO_ 5 M: 8 X\n SG_ Mux M : 0|2@1+ (1,0) [0|0] "" X\n'
    text += "".join(line(name, spec, f"m{k} ") for k, (name, spec) in enumerate(shifted.items()))
    payloads = [bytes([k % len(shifted)]) + data.draw(st.binary(min_size=7, max_size=7)) for k in range(8)]
    recording = record(tmp_path, text, make_frames([5] * 8, payloads))
    oracle = load_string(text, "dbc", strict=False)
    decoded = [oracle.decode_message(5, p, decode_choices=False) for p in payloads]
    loaded = recording.load(recording.channels())
    for name in (*shifted, "Mux"):
        carry = [name in d for d in decoded]
        np.testing.assert_array_equal(loaded[f"M.{name}"].time, recording.frames.time[carry])
        same(loaded[f"M.{name}"].values, [d[name] for d in decoded if name in d])


def test_half_precision_floats_decode():
    # DBC files have no such signals, other databases do.
    little, big = np.zeros((1, 8), np.uint8), np.zeros((1, 8), np.uint8)
    little[0, 2:4] = np.frombuffer(np.array(-1.5, "<f2").tobytes(), np.uint8)
    big[0, 2:4] = little[0, 3:1:-1]
    assert extract(little, Layout(16, 16, True, "f")).tolist() == [-1.5]
    assert extract(big, Layout(23, 16, False, "f")).tolist() == [-1.5]
    shifted = (little.view("<u8") << np.uint64(3)).view(np.uint8)
    assert extract(shifted, Layout(19, 16, True, "f")).tolist() == [-1.5]


@pytest.mark.parametrize("width", [8, 64])
def test_take_is_indexing(width):
    payload = np.random.default_rng(0).integers(0, 256, (50, width), dtype=np.uint8)
    for which in (np.array([3, 3, 49]), payload[:, 0] > 100, np.zeros(0, np.int64)):
        np.testing.assert_array_equal(take(payload, which), payload[which])
    np.testing.assert_array_equal(take(payload[::2], np.array([1])), payload[2:3])


ONE = 'BO_ 256 M: 2 X\n SG_ S : 0|16@1+ (1,0) [0|0] "km/h" X\nCM_ SG_ 256 S "what it is";\n'


def test_channels_say_unit_and_comment(tmp_path):
    recording = record(tmp_path, ONE, make_frames([256], [b"\1\0"]))
    channel = recording.channels()["M.S"]
    assert (channel.name, channel.unit, channel.comment) == ("M.S", "km/h", "what it is")
    assert recording.load(["M.S", "M.T", "N.S", "S", ""]).keys() == {"M.S"}


def test_choices_stay_numbers(tmp_path):
    dbc = 'BO_ 256 M: 1 X\n SG_ S : 0|8@1+ (0.5,1) [0|0] "" X\nVAL_ 256 S 0 "off" 1 "on" 255 "SNA" ;\n'
    recording = record(tmp_path, dbc, make_frames([256] * 3, [b"\0", b"\1", b"\xff"]))
    assert recording.load(["M.S"])["M.S"].values.tolist() == [1.0, 1.5, 128.5]


def test_identifiers_of_11_and_29_bits_are_different(tmp_path):
    dbc = f'{ONE}BO_ {256 + (1 << 31)} E: 2 X\n SG_ S : 0|16@1+ (1,0) [0|0] "" X\n'
    frames = make_frames([256, 256, 256], [b"\1\0", b"\2\0", b"\3\0"], extended=[False, True, False])
    loaded = record(tmp_path, dbc, frames).load(["M.S", "E.S"])
    assert loaded["M.S"].values.tolist() == [1, 3]
    assert loaded["E.S"].values.tolist() == [2]


class TestBuses:
    def frames(self):
        values = [[k, 0] for k in range(6)]
        return make_frames([256] * 6, values, bus=[1, 2, 2, 1, 2, 2])

    def test_the_fullest_is_taken_and_told(self, tmp_path):
        recording = record(tmp_path, ONE, self.frames())
        for _ in range(2):
            assert recording.load(["M.S"])["M.S"].values.tolist() == [1, 2, 4, 5]
        assert recording.faults == ["M is on the buses 1, 2; that on bus 2 is taken (--bus chooses another)"]

    def test_one_can_be_chosen(self, tmp_path):
        recording = record(tmp_path, ONE, self.frames(), bus=1)
        assert recording.load(["M.S"])["M.S"].values.tolist() == [0, 3]
        assert recording.faults == []

    def test_frames_that_are_too_short_do_not_count(self, tmp_path):
        frames = make_frames([256] * 4, [b"\1\0", b"\2", b"\3", b"\4"], bus=[1, 2, 2, 2])
        assert record(tmp_path, ONE, frames).load(["M.S"])["M.S"].values.tolist() == [1]

    def test_absent_one_lists_those_there(self, tmp_path):
        with pytest.raises(LogError) as caught:
            record(tmp_path, ONE, self.frames(), bus=7)
        assert "no frames on bus 7" in caught.value.found
        assert "1 (2 frames), 2 (4 frames)" in caught.value.expected


class TestJ1939:
    DBC = (
        f'BO_ {0x0CF004FE + (1 << 31)} EEC1: 8 X\n SG_ Speed : 24|16@1+ (0.125,0) [0|8031.875] "rpm" X\n'
        'BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";\n'
        f'BA_DEF_DEF_ "VFrameFormat" "J1939PG";\nBA_ "VFrameFormat" BO_ {0x0CF004FE + (1 << 31)} 3;\n'
    )

    def test_priority_and_source_address_do_not_count(self, tmp_path):
        payload = bytes([0, 0, 0, 8, 0, 0, 0, 0])
        frames = make_frames([0x18F00400, 0x0CF00300, 0x18F00400, 0x0CF0043D], [payload] * 4, extended=[True] * 4)
        recording = record(tmp_path, self.DBC, frames)
        signal = recording.load(["EEC1.Speed"])["EEC1.Speed"]
        assert signal.values.tolist() == [1.0, 1.0]
        assert signal.time.tolist() == [0.0, 0.02]
        assert recording.faults == ["EEC1 comes from the source addresses 0, 61; that from 0 is taken"]

    def test_parameter_groups(self):
        assert parameter_group(0x0CF004FE) == 0xF004
        assert parameter_group(0x18EAFF03) == 0xEA00  # the low byte is a destination
        assert parameter_group(0x1DEF1234) == 0x1EF00
        assert not MessageLayout("M", 0x0CF004FE, True).matches(0x18F00400, True)


class TestWrongDatabases:
    def test_that_matches_nothing(self, tmp_path):
        with pytest.raises(LogError) as caught:
            record(tmp_path, ONE, make_frames([1, 1, 2], [b""] * 3))
        assert "0x1 (2 frames), 0x2 (1 frames)" in caught.value.found
        assert "0x100" in caught.value.expected

    @pytest.mark.parametrize("text", ["", "rubbish", "BO_ 256 M: 2", "\0\1\2"])
    def test_that_cannot_be_parsed(self, tmp_path, text):
        with pytest.raises(LogError) as caught:
            record(tmp_path, "VERSION" + text if text else text, make_frames([1], [b""]))
        assert "a.dbc" in caught.value.found

    def test_that_does_not_exist(self, tmp_path):
        with pytest.raises(LogError, match="No such file"):
            load_database(tmp_path / "none.dbc")

    def test_trace_without_frames(self, tmp_path):
        with pytest.raises(LogError, match="no CAN data frames"):
            record(tmp_path, ONE, make_frames([], []))

    def test_most_of_what_is_asked_for_is_absent(self, tmp_path):
        dbc = ONE + "".join(f'BO_ {k} N{k}: 1 X\n SG_ S : 0|8@1+ (1,0) [0|0] "" X\n' for k in range(5))
        recording = record(tmp_path, dbc, make_frames([256, 777], [b"\1\0", b""]))
        recording.load(["M.S"])
        assert recording.faults == []
        recording.load(["M.S", "N1.S", "N2.S"])
        assert "2 of the 3 messages asked for are not in the trace (N1, N2), and 1 of its 2" in recording.faults[0]


def test_names_in_either_encoding(tmp_path):
    text = HEAD + 'BO_ 1 M: 1 X\n SG_ S : 0|8@1+ (1,0) [0|0] "°/s" X\n'
    for encoding in ("utf-8", "utf-8-sig", "cp1252"):
        (tmp_path / "a.dbc").write_bytes(text.encode(encoding))
        assert load_database(tmp_path / "a.dbc").messages["M"].signals["S"].unit == "°/s"


@QUICK
@given(data=st.data())
def test_streams_are_the_frames_of_each_identifier_and_bus(data):
    key = st.tuples(st.integers(0, 3), st.booleans(), st.integers(0, 2**11 - 1))
    keys = data.draw(st.lists(key, max_size=40))
    frames = make_frames(
        [k[2] for k in keys], [b""] * len(keys), bus=[k[0] for k in keys], extended=[k[1] for k in keys]
    )
    streams = find_streams(frames)
    assert {(s.bus, s.extended, s.identifier): s.rows.tolist() for s in streams} == {
        k: [i for i, other in enumerate(keys) if other == k] for k in keys
    }


def test_streams_of_more_identifiers_than_the_hash_separates():
    identifiers = np.random.default_rng(0).permutation(1 << 16)
    frames = make_frames(identifiers, [b""] * identifiers.size, extended=[True] * identifiers.size)
    streams = find_streams(frames)
    assert [s.identifier for s in streams] == list(range(1 << 16))
    assert all(identifiers[s.rows[0]] == s.identifier and len(s) == 1 for s in streams)


@pytest.mark.parametrize(
    ("path", "messages", "strict"),
    [
        ("css-canedge-car/dbc/CSS-Electronics-SAE-J1939-DEMO.dbc", 2, True),
        ("css-canedge-car/dbc/canmod-gps.dbc", 9, True),
        ("comma2k19-rav4/toyota_new_mc_pt_full.dbc", 53, False),
    ],
)
def test_databases_of_real_vehicles(path, messages, strict):
    path = SHARED / path
    if not path.exists():
        pytest.skip(f"{path.name} is not there: ../shared/data holds the recordings of real vehicles")
    database = load_database(path)
    assert len(database.messages) == messages
    assert bool(database.faults) != strict
    assert all(message.j1939 == ("J1939" in path.name) for message in database.messages.values())
    # Every signal of every message, against cantools.
    oracle = load_string(path.read_text("cp1252"), "dbc", strict=False)
    payloads = np.random.default_rng(0).integers(0, 256, (20, 8), dtype=np.uint8)
    identifiers = [message.frame_id for message in oracle.messages for _ in payloads]
    extended = [message.is_extended_frame for message in oracle.messages for _ in payloads]
    frames = make_frames(identifiers, list(payloads) * len(oracle.messages), extended=extended)
    recording = CanRecording("a", "a", frames, path, None, [])
    loaded = recording.load(recording.channels())
    for message in oracle.messages:
        for name, single in alone(message).items():
            decoded = [single.decode(p.tobytes(), decode_choices=False, allow_excess=True)[name] for p in payloads]
            same(loaded[f"{message.name}.{name}"].values, decoded)


def test_drive_of_a_real_car_against_values_decoded_by_others():
    folder, dbc = SHARED / "comma2k19-rav4/processed_log/CAN", SHARED / "comma2k19-rav4/toyota_new_mc_pt_full.dbc"
    if not dbc.exists():
        pytest.skip("comma2k19-rav4 is not there: ../shared/data holds the recordings of real vehicles")
    address, bus, time, data = (np.load(folder / "raw_can" / name) for name in ("address", "src", "t", "data"))
    count = address.size
    payload = np.ascontiguousarray(data).view(np.uint8).reshape(count, 8)
    length = np.full(count, 8, np.uint8)
    frames = Frames(time, bus.astype(np.int16), address.astype(np.uint32), address > 2047, length, payload)
    recording = CanRecording("a", "a", frames, dbc, None, [])
    wheels = [f"WHEEL_SPEEDS.WHEEL_SPEED_{wheel}" for wheel in ("FL", "FR", "RL", "RR")]
    angle = ["STEER_ANGLE_SENSOR.STEER_ANGLE", "STEER_ANGLE_SENSOR.STEER_FRACTION"]
    loaded = recording.load([*wheels, *angle])
    expected = np.load(folder / "wheel_speed/value")
    np.testing.assert_allclose(np.transpose([loaded[name].values / 3.6 for name in wheels]), expected, atol=1e-9)
    whole, fraction = (loaded[name].values for name in angle)
    np.testing.assert_allclose(whole + fraction, np.load(folder / "steering_angle/value").ravel(), atol=1e-9)
