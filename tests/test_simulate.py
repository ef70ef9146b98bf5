"""The simulated car against closed forms, and its log files against the libraries that read such files."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from codriver.errors import LogError, UsageError
from codriver.simulate.bus import BusParameters, Hole, transmit
from codriver.simulate.can_layout import Field, Message, dbc_text, encode
from codriver.simulate.car import GRAVITY, Car
from codriver.simulate.car_parameters import CarParameters
from codriver.simulate.demo import HOLE, demo_drive, write_demo
from codriver.simulate.drive import STEP, drive
from codriver.simulate.network import MESSAGES, STANDARD, names_text
from codriver.simulate.plan import PEAK, Plan, duration_of
from codriver.simulate.powertrain import STAND
from codriver.simulate.road import Grade, Stop, Zone, build_road, demo_road
from codriver.simulate.sensors import Instruments, SensorParameters, measured_log
from codriver.simulate.styles import STYLES
from codriver.simulate.truth import ideal_signals, truth_log

CAR = CarParameters()


@pytest.fixture(scope="module")
def demo():
    return demo_drive(1)


@pytest.fixture(scope="module")
def trace(demo):
    return demo.trace


def declutched(speed: float) -> Car:
    """A car whose clutch stays open: only road, air and brakes act."""
    car = Car(CAR, 0.0, speed)
    car.powertrain.phase, car.powertrain.clutch, car.powertrain.force = STAND, 1.0, 0.0
    return car


def roll(car: Car, seconds: float, brake: float = 0.0, slope: float = 0.0) -> np.ndarray:
    speeds = [car.speed]
    for _ in range(round(seconds / STEP)):
        car.evaluate(brake, slope)
        car.move(STEP)
        speeds.append(car.speed)
    return np.array(speeds)


# ---- motion against closed forms


def test_coast_down_follows_the_arctangent():
    # v = b tan(arctan(v_0 / b) - t sqrt(kappa_1 kappa_2) / M) solves the equation, with b = sqrt(kappa_1 / kappa_2)
    speeds = roll(declutched(30.0), 100.0)
    t = np.arange(speeds.size) * STEP
    b, rate = math.sqrt(CAR.rolling / CAR.drag), math.sqrt(CAR.rolling * CAR.drag) / CAR.mass
    np.testing.assert_allclose(speeds, b * np.tan(math.atan(30.0 / b) - rate * t), atol=2e-3)


def test_terminal_speed_downhill():
    slope = -0.06
    wanted = math.sqrt((-CAR.mass * GRAVITY * math.sin(slope) - CAR.rolling) / CAR.drag)
    assert roll(declutched(50.0), 400.0, slope=slope)[-1] == pytest.approx(wanted, abs=0.01)


def test_brake_stop_distance_and_time():
    pressure, v = 30e5, 20.0
    car = declutched(v)
    speeds = roll(car, 8.0, brake=pressure)
    friction = CAR.rolling + CAR.brake * pressure
    distance = CAR.mass / (2 * CAR.drag) * math.log(1 + CAR.drag * v * v / friction)
    assert car.distance == pytest.approx(distance, abs=0.02)
    assert speeds[-1] == 0.0
    assert speeds.min() >= 0.0


@pytest.mark.parametrize(
    ("slope", "pressure", "holds"), [(0.1, 14e5, True), (0.1, 7e5, False), (0.005, 0.0, True), (-0.1, 7e5, False)]
)
def test_standstill_holds_as_long_as_friction_is_enough(slope, pressure, holds):
    assert (CAR.mass * GRAVITY * math.sin(abs(slope)) < CAR.rolling + CAR.brake * pressure) == holds
    car = declutched(0.0)
    roll(car, 1.0, brake=pressure, slope=slope)
    assert (car.distance == 0.0) == holds
    if not holds:
        assert math.copysign(1, car.distance) == -math.copysign(1, slope)


def test_energy_balance(trace):
    """Work of the clutch torque = kinetic + potential energy + losses, over the whole drive."""
    v, dt = trace["speed"], trace.dt
    way = np.diff(trace["distance"])

    def work(force):
        return float((force[:-1] * way).sum())

    drive_work = work(trace.tau * trace["passed"])
    lost = work(CAR.brake * trace["brake"]) + work(CAR.rolling + CAR.drag * v * v)
    risen = trace.road.at(trace.road.height, trace["distance"])
    kinetic = 0.5 * CAR.mass * (v[-1] ** 2 - v[0] ** 2)
    potential = CAR.mass * GRAVITY * (risen[-1] - risen[0])
    assert dt == pytest.approx(STEP)
    assert drive_work == pytest.approx(kinetic + potential + lost, rel=2e-3)
    assert drive_work > 5e5


def test_distance_is_the_integral_of_speed(trace):
    np.testing.assert_allclose(np.cumsum(trace["speed"])[-1] * STEP, trace["distance"][-1], rtol=1e-4)


# ---- powertrain


def test_a_locked_clutch_passes_the_engine_torque_and_couples_speeds(trace):
    locked = (trace["clutch"] == 0.0) & (trace["shifting"] == 0) & (trace["speed"] > 3.0)
    assert locked.mean() > 0.5
    # But for the single steps in which the clutch begins to open.
    assert np.mean(trace["passed"][locked] == trace["torque"][locked]) > 0.9995
    np.testing.assert_allclose(
        trace["engine_speed"][locked], (trace["speed"] * trace.tau)[locked] / CAR.efficiency, rtol=2e-3, atol=0.5
    )


def test_every_shift_interrupts_the_torque(trace):
    shifting = np.flatnonzero(np.diff((trace["shifting"] != 0).astype(int)))
    starts, ends = shifting[::2], shifting[1::2]
    assert starts.size >= 12
    for i, k in zip(starts, ends, strict=True):
        part = slice(i + 1, k + 1)
        opened = trace["clutch"][part] > 0.999
        assert 0.4 <= (k - i) * STEP <= 1.3
        assert opened.sum() * STEP >= 0.1
        assert np.abs(trace["passed"][part][opened]).max() < 1.0
        # Gears change only while the clutch is open.
        changes = np.flatnonzero(np.diff(trace["gear"][i : k + 2])) + i + 1
        assert changes.size == 1
        assert trace["clutch"][changes[0]] > 0.999


def test_a_downshift_blips_and_an_upshift_drags(trace):
    opened = trace["clutch"] > 0.999
    moving = trace["speed"] > 4.0
    assert trace["torque"][opened & moving & (trace["shifting"] < 0)].max() > 40.0
    assert trace["torque"][opened & moving & (trace["shifting"] > 0)].min() < -20.0


def test_pedals_and_torque_agree_most_of_the_time(trace):
    pressed = (trace["pedal"] > 0.1) & (trace["shifting"] == 0) & (trace["clutch"] == 0)
    np.testing.assert_allclose(trace["request"], CAR.pedal * trace["pedal"])
    assert np.median(np.abs(trace["torque"] - trace["request"])[pressed]) < 5.0


# ---- driver


def test_a_burst_peaks_as_the_closed_form_says_and_ends_where_it_should():
    plan = Plan(0.5)
    plan.burst(1.0, -1.5, 2.0)
    t = np.linspace(1.0, 3.0, 2001)
    a, j = np.array([plan.at(x) for x in t]).T
    assert a[0] == 0.5
    assert a[-1] == pytest.approx(-1.5)
    assert np.abs(j).max() == pytest.approx(PEAK * 2.0 / 2.0, rel=1e-6)
    np.testing.assert_allclose(np.gradient(a, t)[1:-1], j[1:-1], atol=1e-4)


def test_bursts_add_and_stay_smooth():
    plan = Plan()
    plan.burst(0.0, 2.0, 2.0)
    before = plan.at(1.0)
    plan.burst(1.0, -1.0, 1.5)
    after = plan.at(1.0)
    assert before == pytest.approx(after)
    assert plan.at(9.0) == (-1.0, 0.0)
    assert duration_of(2.0, 1.5) == pytest.approx(PEAK * 2.0 / 1.5)


@pytest.mark.parametrize("name", sorted(STYLES))
def test_every_driver_keeps_to_the_road_and_to_human_bounds(name):
    made = drive(demo_road(), 150.0, style=STYLES[name], seed=3)
    moving = made["speed"] > 1.0
    a, jerk = made["acceleration"], made["planned_jerk"]
    assert a.min() > -4.6
    assert a.max() < 3.6
    assert np.abs(jerk).max() < 2.2 * STYLES[name].jerk + 1.5
    assert np.abs(jerk).max() > 0.5
    limit = made.road.at(made.road.limit, made["distance"])
    assert np.percentile((made["speed"] - STYLES[name].speed * limit)[moving], 95) < 3.0
    # One foot: never both pedals, and some time between them.
    assert not np.any((made["pedal"] > 0.01) & (made["brake"] > 0.2e5))
    # It stops at the give-way line.
    line = np.abs(made["distance"] - 1630.0) < 25.0
    assert made["speed"][line].min() == 0.0
    # Nobody chatters on the pedals.
    turns = np.diff(np.sign(np.where(np.abs(made["pedal_rate"]) > 0.05, made["pedal_rate"], 0.0)))
    assert np.count_nonzero(np.abs(turns) == 2) < 20


def test_the_actual_acceleration_follows_the_plan(trace):
    calm = (trace["shifting"] == 0) & (trace["speed"] > 3.0)
    error = trace["acceleration"] - trace["planned_acceleration"]
    assert np.sqrt(np.mean(error[calm] ** 2)) < 0.45
    assert np.corrcoef(trace["acceleration"][calm], trace["planned_acceleration"][calm])[0, 1] > 0.9


def test_styles_differ_in_jerk():
    def effort(name):
        return np.sqrt(np.mean(drive(demo_road(), 100.0, style=STYLES[name], seed=1)["planned_jerk"] ** 2))

    assert effort("smooth") < effort("ordinary") < effort("aggressive")


def test_a_road_must_be_covered():
    with pytest.raises(UsageError, match="start at 0"):
        build_road("x", 100, [Zone(10, 10)])
    with pytest.raises(UsageError, match="lengthen"):
        build_road("x", 100, [Zone(0, 10)], stops=[Stop(200, 1)])
    road = build_road("x", 400, [Zone(0, 10)], grades=[Grade(100, 100, 0.05)])
    assert road.slope[-1] == pytest.approx(math.atan(0.05))
    assert road.height[-1] == pytest.approx(math.sin(math.atan(0.05)) * 250, rel=0.01)


# ---- truth


def test_intention_plus_known_input_is_the_acceleration(demo):
    truth = demo.truth
    moving = truth["longitudinal_speed"].values > 0.05
    total = truth["intentional_acceleration"].values + truth["known_input"].values
    np.testing.assert_allclose(total[moving], truth["longitudinal_acceleration"].values[moving], atol=1e-9)


def test_the_jerk_is_the_derivative_where_the_intention_is_smooth(trace):
    truth = truth_log(trace, rate=500.0)
    a, j = truth["intentional_acceleration"].values, truth["intentional_jerk"].values
    numeric = np.gradient(a, STEP)
    smooth = np.ones(a.size, bool)
    for name in ("gear", "braking"):
        for k in np.flatnonzero(np.diff(truth[name].values)):
            smooth[max(0, k - 2) : k + 4] = False
    error = np.abs(numeric - j)[smooth]
    # A pedal that reaches its stop within a step has no derivative there.
    assert np.percentile(error, 99.9) < 0.15
    assert np.sqrt(np.mean(error**2)) < 0.05


def test_ideal_signals_carry_exactly_the_intention_asked_for(trace, demo):
    for of, name in (("model", "intentional_acceleration"), ("plan", "planned_acceleration")):
        ideal = ideal_signals(trace, of)
        left = ideal["longitudinal_acceleration"].values - ideal["known_input"].values
        wanted = demo.truth[name].values + demo.truth["acceleration_offset"].values
        np.testing.assert_allclose(left, wanted, atol=1e-12)


# ---- sensors


def test_noise_has_the_statistics_asked_for(trace):
    sensors = SensorParameters(pitch_gain=0.0, ring_share=0.0, acceleration_noise=0.08, bias=0.05)
    log = measured_log(trace, sensors, seed=5)
    y = log["longitudinal_acceleration"]
    clean = np.interp(y.time, trace["time"], trace["acceleration"] + GRAVITY * np.sin(trace["slope"]))
    noise = y.values - clean
    assert noise.mean() == pytest.approx(0.05, abs=3 * 0.08 / math.sqrt(noise.size))
    assert noise.std() == pytest.approx(math.hypot(0.08, 0.01 / math.sqrt(12)), rel=0.03)
    white = np.corrcoef(noise[:-1], noise[1:])[0, 1]
    assert abs(white) < 0.03
    v = log["longitudinal_speed"]
    fast = v.values > 5.0
    error = (v.values - np.interp(v.time, trace["time"], trace["speed"]))[fast]
    assert error.std() == pytest.approx(math.hypot(0.012, 0.01 / math.sqrt(12)) / math.sqrt(2), rel=0.05)


def test_steps_of_the_converters(demo):
    for name, step in (("accelerator_pedal", 0.004), ("brake_pressure", 1e4), ("engine_torque", 0.5)):
        raw = demo.measured[name].values / step
        np.testing.assert_allclose(raw, np.round(raw), atol=1e-6)
    stands = np.interp(demo.measured["longitudinal_speed"].time, demo.trace["time"], demo.trace["speed"]) < 0.25
    assert np.all(demo.measured["longitudinal_speed"].values[stands] == 0.0)


def test_the_body_pitches_and_the_driveline_rings(trace):
    quiet = SensorParameters(acceleration_noise=0.0, acceleration_step=1e-9, bias=0.0, ring_share=0.0, pitch_gain=0.002)
    t = trace["time"]
    y = Instruments(trace, quiet, 1).read("longitudinal_acceleration", t)
    pitch = (y - trace["acceleration"]) / GRAVITY - np.sin(trace["slope"])
    braking = (trace["acceleration"] < -1.5) & (trace["speed"] > 5)
    assert pitch[braking].mean() == pytest.approx(0.002 * trace["acceleration"][braking].mean(), rel=0.1)
    rings = Instruments(trace, replace(quiet, pitch_gain=0.0, ring_share=0.5), 1).read("longitudinal_acceleration", t)
    ring = rings - trace["acceleration"] - GRAVITY * np.sin(trace["slope"])
    upshift = int(np.flatnonzero(np.diff((trace["shifting"] > 0).astype(int)) > 0)[1])
    assert np.abs(ring[upshift : upshift + 500]).max() > 0.1
    spectrum = np.abs(np.fft.rfft(ring * np.hanning(ring.size)))
    assert 4.0 < np.fft.rfftfreq(ring.size, STEP)[spectrum.argmax()] < 8.0


# ---- bus


def test_layouts_do_not_overlap_and_the_dbc_is_valid():
    import cantools

    for message in MESSAGES:
        places = [place for field in message.fields for place in field.bits()]
        assert len(places) == len(set(places)), message.name
        assert all(byte < message.length for byte, _ in places), message.name
    database = cantools.database.load_string(dbc_text(MESSAGES, "test"), "dbc", strict=True)
    assert {m.name: m.frame_id for m in database.messages} == {m.name: m.identifier for m in MESSAGES}
    orders = {s.byte_order for m in database.messages for s in m.signals}
    assert orders == {"little_endian", "big_endian"}
    assert any(s.is_signed for m in database.messages for s in m.signals)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: m.name)
def test_encoding_is_that_of_cantools(message):
    import cantools

    database = cantools.database.load_string(dbc_text(MESSAGES, "test"), "dbc")
    random = np.random.default_rng(message.identifier)
    columns = {}
    for field in message.fields:
        low, high = field.raw_range
        raw = random.integers(low, high + 1, 40)
        raw[:2] = low, high
        columns[field.name] = raw * field.factor + field.offset
    payload = encode(message, columns)
    for k in range(40):
        decoded = database.decode_message(message.identifier, payload[k].tobytes(), decode_choices=False)
        for name, column in columns.items():
            assert decoded[name] == pytest.approx(column[k], abs=1e-9)
        values = {name: column[k] for name, column in columns.items()}
        assert database.encode_message(message.identifier, values, strict=False) == payload[k].tobytes()


def test_values_out_of_range_are_held_not_wrapped():
    message = Message(
        "M", 1, 10, 2, (Field("A", "x", 0, 8, 1.0, 0.0, signed=True), Field("B", "y", 15, 4, motorola=True)), "N"
    )
    payload = encode(message, {"A": np.array([-500.0, 500.0]), "B": np.array([99.0, -3.0])})
    np.testing.assert_array_equal(payload, [[0x80, 0xF0], [0x7F, 0x00]])


def test_rates_losses_jitter_and_holes(demo):
    frames = demo.frames
    assert np.all(np.diff(frames.time) >= 0)
    for message in MESSAGES:
        time = frames.time[frames.identifier == message.identifier]
        whole = 180.0 * message.rate - (HOLE.length * message.rate if message.name == HOLE.message else 0)
        assert time.size == pytest.approx(whole * 0.995, rel=0.01)
    dynamics = frames.time[frames.identifier == 0x1B4]
    steps = np.diff(dynamics)
    assert np.std(steps[steps < 0.015]) == pytest.approx(0.0003 * math.sqrt(2), rel=0.1)
    wheels = frames.time[frames.identifier == 0x1C6]
    assert np.diff(wheels).max() == pytest.approx(HOLE.length, abs=0.06)


def test_counters_show_the_losses(trace):
    bus = BusParameters(loss=0.02, holes=(Hole("Steering", 3.0, 0.5),))
    frames = transmit(Instruments(trace, SensorParameters(), 1), 20.0, bus, seed=4)
    payload = frames.data[frames.identifier == 0x0A5]
    skipped = (np.diff(payload[:, 3].astype(int) & 15) - 1) % 16
    assert skipped.sum() + payload.shape[0] == pytest.approx(1000, abs=20)
    assert skipped.max() >= 9


# ---- the demo


def test_the_demo_contains_what_it_promises(demo):
    trace, truth = demo.trace, demo.truth
    gears = np.diff(trace["gear"])
    assert np.count_nonzero(gears > 0) >= 6
    assert np.count_nonzero(gears < 0) >= 6
    v = trace["speed"]
    assert v[0] == 0.0
    stops = np.flatnonzero((v[:-1] > 0) & (v[1:] == 0))
    assert stops.size >= 2
    assert trace["acceleration"].min() < -2.0
    assert trace["acceleration"].max() > 1.8
    slopes = trace["slope"][v > 1]
    assert slopes.max() > 0.045
    assert slopes.min() < -0.03
    released = (trace["pedal"] == 0) & (trace["brake"] == 0) & (v > 5)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], released.astype(int), [0]])))
    assert (edges[1::2] - edges[::2]).max() * STEP > 3.0
    assert truth["distance"].values[-1] > 2000
    assert demo.measured.implausible() == []
    assert truth.implausible() == []


def test_the_same_seed_gives_the_same_drive(demo):
    again, other = demo_drive(1), demo_drive(2)
    np.testing.assert_array_equal(again.frames.data, demo.frames.data)
    np.testing.assert_array_equal(again.frames.time, demo.frames.time)
    assert other.frames.data.shape != demo.frames.data.shape or not np.array_equal(other.frames.data, demo.frames.data)


def test_written_files_read_back(demo, tmp_path):
    import can
    import cantools

    from codriver.logs import read

    files = write_demo(tmp_path / "demo", seed=1)
    assert {path.name for path in (files.log, files.dbc, files.names, files.truth, files.logger)} == {
        "drive.blf", "car.dbc", "names.toml", "truth.parquet", "logger.csv",
    }  # fmt: skip
    database = cantools.database.load_file(files.dbc)
    with can.LogReader(str(files.log)) as reader:
        messages = list(reader)
    assert len(messages) == len(demo.frames)
    for k in range(0, len(messages), 997):
        assert messages[k].timestamp == pytest.approx(demo.frames.time[k], abs=2e-6)
        decoded = database.decode_message(messages[k].arbitration_id, messages[k].data)
        if "ESC_AccelX" in decoded:
            expected = np.interp(messages[k].timestamp, demo.trace["time"], demo.trace["acceleration"])
            assert decoded["ESC_AccelX"] == pytest.approx(expected, abs=1.2)
    log = read(files.log, dbc=files.dbc, names=files.names)
    assert set(log) == set(STANDARD)
    assert set(names_text().split()) & {"[engine_torque]"}
    for name, column, sd in (
        ("longitudinal_speed", "speed", 0.009),
        ("accelerator_pedal", "pedal", 0.0016),
        ("engine_torque", "torque", 0.34),
    ):
        signal = log[name]
        moving = np.interp(signal.time, demo.trace["time"], demo.trace["speed"]) > 1.0
        error = signal.values - np.interp(signal.time - BusParameters().latency, demo.trace["time"], demo.trace[column])
        assert error[moving].std() < 1.15 * sd, name
    table = read(files.truth)
    np.testing.assert_allclose(table["intentional_jerk"].values, demo.truth["intentional_jerk"].values)


# ---- the demo's folder


def test_demo_replaces_only_a_demo(demo, tmp_path, monkeypatch):
    monkeypatch.setattr("codriver.simulate.demo.demo_drive", lambda seed: demo)
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "names.toml").write_text("mine")
    with pytest.raises(UsageError, match="no demo"):
        write_demo(foreign)
    assert [(p.name, p.read_text()) for p in foreign.iterdir()] == [("names.toml", "mine")]
    with pytest.raises(UsageError, match="is a file"):
        write_demo(foreign / "names.toml")
    (tmp_path / "own").mkdir()
    files = write_demo(tmp_path / "own")
    (tmp_path / "own" / "report.html").write_text("of the demo")
    files.names.write_text("changed")
    write_demo(tmp_path / "own")
    assert files.names.read_text(encoding="utf-8") == names_text()


def test_demo_is_whole_or_nothing(demo, tmp_path, monkeypatch):
    monkeypatch.setattr("codriver.simulate.demo.demo_drive", lambda seed: demo)

    def full(path, frames):
        path.write_bytes(b"LOGG")
        raise OSError(28, "No space left on device")

    files = write_demo(tmp_path / "demo")
    before = files.log.read_bytes()
    monkeypatch.setattr("codriver.simulate.demo.write_trace", full)
    for folder in ("new", "demo"):
        with pytest.raises(LogError, match="No space left on device"):
            write_demo(tmp_path / folder)
    assert [p.name for p in tmp_path.iterdir()] == ["demo"]
    assert files.log.read_bytes() == before


def test_logger_of_the_demo(demo, tmp_path, monkeypatch):
    monkeypatch.setattr("codriver.simulate.demo.demo_drive", lambda seed: demo)
    path = write_demo(tmp_path / "demo").logger
    assert path.read_text().splitlines()[0] == "t,VehSpd,AccX_g,TqEng,TqDrv,GearAct"
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 0], 0.05 + 0.02 * np.arange(5998), atol=1e-9)
    acceleration = demo.measured["longitudinal_acceleration"]
    newest = np.searchsorted(acceleration.time, rows[:, 0] + 1e-9, side="right") - 1
    np.testing.assert_allclose(rows[:, 2] * -GRAVITY, acceleration.values[newest], atol=5e-4)
    assert np.array_equal(rows[:, 5], rows[:, 5].round())
