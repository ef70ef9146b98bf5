"""Programs, steppers and estimates."""

import numpy as np
import pytest

import codriver as cd
from codriver.errors import DesignError, MissingSignal, UsageError
from codriver.observers import Observer, Output
from codriver.program import Stepper
from codriver.signals import Channel, Grid, Sampler
from codriver.testing import check_observer
from conftest import constant, motion_log


def test_five_lines(demo_files):
    """The README's five lines."""
    log = cd.read(demo_files.log, dbc=demo_files.dbc, names=demo_files.names)
    vehicle = cd.load_vehicle("bisoffi2017")
    observer = cd.build("intent-pedals", vehicle, dt=0.01, ell=2)
    program = cd.compile(observer)
    estimate = program.run(log)
    assert {"intentional_jerk", "intentional_jerk_sd", "valid"} <= set(estimate)
    assert estimate.check().trusted
    assert estimate.provenance["vehicle"] == "bisoffi2017"


def test_live_bus_equals_batch(car, demo):
    """Values pushed one by one into a Sampler, ticks stepped live: the bits of the batch."""
    program = cd.compile(cd.build("intent-pedals", car))
    log = demo.measured.between(0, 20)
    estimate = program.run(log)
    sampler = Sampler([Channel.named(c) for c in program.observer.channels], program.observer.dt)
    values = sorted(
        (t, name, v) for name in program.observer.channels if name in log
        for t, v in zip(log[name].time, log[name].values, strict=True)
    )  # fmt: skip
    stepper, at = program.live(), 0
    for k, tick in enumerate(estimate.time):
        while at < len(values) and values[at][0] <= tick + 2e-6:
            sampler.push(values[at][1], values[at][0], values[at][2])
            at += 1
        row, fresh, held = sampler.row(tick)
        ok = [(fresh if c in program.observer.measured else held)[c] for c in program.observer.channels]
        out = stepper([*[row[c] for c in program.observer.channels], *ok])
        assert out == tuple(estimate.columns[name][k] for name in stepper.outputs)


def test_saved_state_continues_with_the_same_bits(car):
    program = cd.compile(cd.build("kinematic", dt=0.01))
    log, _ = motion_log(10)
    rows = [
        {"longitudinal_acceleration": a, "longitudinal_speed": v}
        for a, v in zip(log["longitudinal_acceleration"].values, log["longitudinal_speed"].values, strict=True)
    ]
    whole = program.live()
    answers = [whole.step(row) for row in rows]
    first = program.live()
    for row in rows[:500]:
        first.step(row)
    second = cd.compile(cd.build("kinematic", dt=0.01)).live()
    second.restore(first.save())
    assert [second.step(row) for row in rows[500:]] == answers[500:]


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"dt": "0x1p-3", "carry": {}}', "null"])
def test_wrong_state_is_refused(text):
    stepper = cd.compile(cd.build("kinematic")).live()
    with pytest.raises(UsageError):
        stepper.restore(text)


def test_state_of_another_design_is_refused():
    other = cd.compile(cd.build("kinematic", dt=0.02)).live().save()
    with pytest.raises(UsageError, match=r"saved with dt = 0\.02"):
        cd.compile(cd.build("kinematic", dt=0.01)).live().restore(other)
    slow = cd.compile(cd.build("kinematic", dt=0.01, ell=1)).live().save()
    with pytest.raises(UsageError, match=r"ell = 1"):
        cd.compile(cd.build("kinematic", dt=0.01, ell=3)).live().restore(slow)


def test_state_of_another_vehicle_of_that_name_is_refused(car):
    """The vehicle's numbers are constants of the step, and the step's fingerprint is in the state."""
    saved = cd.compile(cd.build("intent-pedals", car)).live().save()
    heavy = car.with_parameter("mass", 1.1 * car.number("mass"))
    with pytest.raises(UsageError, match="step ="):
        cd.compile(cd.build("intent-pedals", heavy)).live().restore(saved)


def test_a_drive_in_pieces(car, demo):
    """Piece by piece, with the carry handed on: the bits of the whole."""
    program = cd.compile(cd.build("intent-pedals", car))
    grid = demo.measured.sample(program.observer.channels, 0.01)
    whole, carry, parts = program.run_grid(grid), program.observer.carry, []
    for piece in np.array_split(np.arange(len(grid)), 7):
        part = Grid(
            grid.time[piece],
            grid.dt,
            *({n: c[piece] for n, c in columns.items()} for columns in (grid.values, grid.fresh, grid.held)),
        )
        carry, out = program.advance(part, carry)
        parts.append(out)
    for name, column in whole.items():
        np.testing.assert_array_equal(np.concatenate([part[name] for part in parts]), column)


def test_a_signal_held_by_one_and_measured_by_another():
    """In a chain each part sees the flag of its own role: held for the input, fresh for the measurement."""
    holds = Observer(
        "holds", 0.01, ("longitudinal_speed",), (), {"n": 0.0}, (Output("held_share", "1", "flag"),),
        lambda c, u, y, ok, rho: ({"n": c["n"] + 1.0}, {"held_share": ok["longitudinal_speed"]}),
    )  # fmt: skip
    measures = Observer(
        "measures", 0.01, (), ("longitudinal_speed",), {"m": 0.0}, (Output("fresh_share", "1", "flag"),),
        lambda c, u, y, ok, rho: ({"m": c["m"] + 1.0}, {"fresh_share": ok["longitudinal_speed"]}),
    )  # fmt: skip
    both = cd.chain(holds, measures)
    assert both.channels == ("longitudinal_speed",)
    assert [flag.name for flag in both.flags] == ["longitudinal_speed_fresh", "longitudinal_speed_held"]
    t = np.arange(0, 2, 0.02)
    estimate = cd.compile(both).run(cd.Log.of([constant("longitudinal_speed", 5, t)]))
    assert estimate.flag("held_share").all()
    assert estimate.flag("fresh_share").mean() == pytest.approx(0.5, abs=0.01)
    check_observer(both)


def test_missing_signal_says_what_is_missing(car):
    log, _ = motion_log(10)
    with pytest.raises(MissingSignal, match="lacks accelerator_pedal, brake_pressure, engine_torque, gear"):
        cd.compile(cd.build("intent-pedals", car)).run(log)


def test_unknown_names():
    observer = cd.build("kinematic")
    with pytest.raises(UsageError, match="no output"):
        cd.compile(observer, ["jerk"])
    with pytest.raises(UsageError, match="did you mean 'kinematic'"):
        cd.build("kinematics")
    with pytest.raises(UsageError, match="'kalman' or 'constant'"):
        cd.build("kinematic", form="kalmann")
    log, _ = motion_log(2)
    with pytest.raises(MissingSignal, match="no output 'jerk'"):
        cd.compile(observer).run(log)["jerk"]


def adder(name: str, reads: str, writes: str, dt: float = 0.01, carry: str = "s") -> Observer:
    """y = u + 1, with a count carried."""

    def step(c, u, y, ok, rho):
        return {carry: c[carry] + 1.0}, {writes: u[reads] + 1.0}

    return Observer(name, dt, (reads,), (), {carry: 0.0}, (Output(writes, "1", "estimate"),), step)


def test_chain_is_an_observer():
    """Outputs feed inputs of the same name; three in a row; the carry holds all."""
    three = cd.chain(cd.chain(adder("a", "x", "p"), adder("b", "p", "q", carry="t")), adder("c", "q", "r", carry="w"))
    assert three.channels == ("x",)
    out = cd.compile(three).live().step({"x": 1.0})
    assert out == {"p": 2.0, "q": 3.0, "r": 4.0}
    with pytest.raises(DesignError, match="both carry"):
        cd.chain(adder("a", "x", "p"), adder("b", "p", "q"))
    with pytest.raises(DesignError, match="ticks"):
        cd.chain(adder("a", "x", "p"), adder("b", "p", "q", dt=0.02, carry="t"))


def test_empty_and_tiny_logs():
    """Three samples give three rows, none of them valid; no crash."""
    t = np.array([0.0, 0.01, 0.02])
    log = cd.Log.of([constant("longitudinal_speed", 5, t), constant("longitudinal_acceleration", 0, t)])
    estimate = cd.compile(cd.build("kinematic")).run(log)
    assert len(estimate.grid) == 3
    assert not estimate.valid.any()
    assert not estimate.check().trusted


def test_stepper_is_quick_to_call():
    """The row form does not build a mapping: its arguments are the recorded inputs, in order."""
    stepper = cd.compile(cd.build("kinematic")).live()
    assert isinstance(stepper, Stepper)
    assert stepper.inputs[:3] == ("gear", "longitudinal_acceleration", "longitudinal_speed")
    assert len(stepper([1.0, 0.0, 5.0, 1, 1, 1])) == len(stepper.outputs)
