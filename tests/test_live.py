"""A drive played back through a live session gives the batch's estimate."""

import numpy as np
import pytest

import codriver as cd
from codriver.errors import LogError, NamesError
from codriver.live import BusDecoder, Live, listen


@pytest.mark.parametrize("seconds", [25.0])
def test_playback_equals_batch(demo_files, car, seconds):
    """BLF frames through python-can and cantools into a Live session, against `read` and `run`."""
    can = pytest.importorskip("can")
    program = cd.compile(cd.build("intent-pedals", car))
    batch = program.run(cd.read(demo_files.log, dbc=demo_files.dbc, names=demo_files.names))
    with can.BLFReader(str(demo_files.log)) as reader:
        begin = reader.start_timestamp
        frames = []
        for message in reader:
            message.timestamp = round(message.timestamp - begin, 9)
            if message.timestamp > seconds:
                break
            frames.append(message)
    ticks = list(listen(frames, Live(program), BusDecoder(demo_files.dbc, demo_files.names)))
    assert len(ticks) > 100 * (seconds - 1)
    np.testing.assert_allclose([t.time for t in ticks], batch.time[: len(ticks)], atol=1e-9)
    for name in ("intentional_jerk", "intentional_jerk_sd", "longitudinal_speed", "valid"):
        live = np.array([t.values[name] for t in ticks])
        np.testing.assert_allclose(live, batch.columns[name][: len(ticks)], rtol=1e-9, atol=1e-12, err_msg=name)


def test_virtual_bus(demo_files, car):
    """Frames over python-can's virtual bus; unknown and short frames do no harm."""
    can = pytest.importorskip("can")
    program = cd.compile(cd.build("kinematic"))
    with (
        can.Bus(interface="virtual", channel="codriver") as sender,
        can.Bus(interface="virtual", channel="codriver") as bus,
    ):
        with can.BLFReader(str(demo_files.log)) as reader:
            sent = [message for message, _ in zip(reader, range(400), strict=False)]
        sender.send(can.Message(arbitration_id=0x7FF, data=b"\x01", is_extended_id=False))
        for message in sent:
            sender.send(message)
        sender.send(can.Message(arbitration_id=sent[0].arbitration_id, data=b"\x01", is_extended_id=False))
        received = []
        while (message := bus.recv(0.05)) is not None:
            received.append(message)
    ticks = list(listen(received, Live(program), BusDecoder(demo_files.dbc, demo_files.names)))
    assert len(received) == 402
    assert all(np.isfinite(list(t.values.values())).all() for t in ticks)


@pytest.mark.parametrize("begin", [0.0, 1.5e9])
@pytest.mark.parametrize("late", [0.0, 3e-5, 1.7e-4])
def test_stamps_that_meet_the_ticks(begin, late, car):
    """Values stamped at the ticks or shortly after, from 0 and since 1970: live has the bits of the batch."""
    t = begin + np.arange(600) * 0.01 + late
    rng = np.random.default_rng(3)
    log = cd.Log.of([
        cd.Signal("longitudinal_acceleration", t, rng.standard_normal(600), "m/s^2"),
        cd.Signal("longitudinal_speed", t[::2], 10 + rng.standard_normal(300), "m/s"),
    ])  # fmt: skip
    program = cd.compile(cd.build("kinematic", dt=0.01))
    batch = program.run(log)
    rows = sorted((x, n, v) for n, s in log.items() for x, v in zip(s.time, s.values, strict=True))
    live, ticks = Live(program), []
    for stamp, name, value in rows:
        ticks += live.advance_before(stamp)
        live.push(name, stamp, value)
    ticks += live.advance(rows[-1][0] + 1e-3)
    n = min(len(ticks), len(batch.grid))
    assert n >= 599
    for name in ("longitudinal_jerk", "longitudinal_jerk_sd"):
        np.testing.assert_array_equal([tick.values[name] for tick in ticks[:n]], batch.columns[name][:n])


def test_nothing_before_the_first_measurement(car):
    live = Live(cd.compile(cd.build("intent-pedals", car)))
    live.push("gear", 0.0, 3.0)
    assert list(live.advance(1.0)) == []
    live.push("longitudinal_speed", 1.0, 5.0)
    assert [round(t.time, 3) for t in live.advance(1.025)] == [1.0, 1.01, 1.02]


def test_wrong_files(demo_files, tmp_path):
    (tmp_path / "bad.dbc").write_text("this is no database")
    with pytest.raises(LogError, match="CAN database"):
        BusDecoder(tmp_path / "bad.dbc", demo_files.names)
    names = tmp_path / "names.toml"
    names.write_text('[gear]\nsource = "Gearbox.NoSuch"\n')
    with pytest.raises(NamesError, match=r"Gearbox\.NoSuch"):
        BusDecoder(demo_files.dbc, names)
