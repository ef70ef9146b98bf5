"""2017 section IV-A: c_b, kappa_1, kappa_2 and c_r from the drive, and which of them matters (figures 1 to 3)."""

from __future__ import annotations

import numpy as np

from codriver.estimate import Estimate
from codriver.identify import BrakeFit, identify_brake, identify_pedal
from codriver.papers.drives import Driven
from codriver.papers.item import Item, near
from codriver.papers.reproduction import Chapter
from codriver.program import compile
from codriver.report.document import Table
from codriver.report.identification import learning_chart, pedal_chart, validation_chart
from codriver.simulate import ROAD_TEST_SENSORS
from codriver.simulate.judge import rms
from codriver.vehicles import Vehicle

_BAND = 0.05  # of figure 2
_SOME = 2.0  # min
_CHANGED = 1.05  # each parameter in turn by this factor


def identification_chapter(driven: Driven, vehicle: Vehicle, intent: Estimate) -> Chapter:
    """Figures 1 to 3.

    Args:
        driven: the drive that is identified from.
        vehicle: mass and transmission are taken from it, and the rest compared with.
        intent: intent-pedals with it, at ell = 2.
    """
    brake = identify_brake(driven.log, vehicle)
    pedal = identify_pedal(driven.log, vehicle)
    heavier = vehicle.with_parameter("mass", _CHANGED * vehicle.number("mass"))
    plain, heavy = (identify_brake(driven.log, v, pitch=False) for v in (vehicle, heavier))
    with_gain = identify_brake(driven.log, heavier).coefficients["c_b"].value
    found = {name: c.value for name, c in brake.coefficients.items()}
    moved = heavy.coefficients["c_b"].value / plain.coefficients["c_b"].value - 1
    rest, whole = _minutes_to_rest(brake), brake.minutes_fit
    some = max(rest, _SOME)
    bias = ROAD_TEST_SENSORS.bias
    truly = found["kappa_1"] + vehicle.number("mass") * bias
    r2 = 1 - (brake.rmse / brake.rmse_constant) ** 2
    changes = _sensitivity(driven, vehicle, intent)
    items = (
        near("IV-A: c_b", 189.0, found["c_b"] * 1e5, "N/bar", 0.005, _interval(brake, "c_b", 1e5)),
        Item("IV-A: kappa_1", 131.0, truly, "N", abs(truly - 131.0) <= 6.0,
             f"least squares gives kappa_1 − M d_a = {found['kappa_1']:.1f} N, since bias and kappa_1 cannot be told apart; shown "
             f"with the simulated bias of {bias:g} m/s² added back; within 6 N counts. The paper neglects the bias"),
        near("IV-A: kappa_2", 0.283, found["kappa_2"], "kg/m", 0.02, _interval(brake, "kappa_2", 1.0)),
        near("IV-A: c_r", 3.25, pedal.c_r / 100, "N m/%", 0.001, f"R² {pedal.r2:.4f}"),
        Item("fig. 1: [y_1]_F and a_ID match well", "well", brake.rmse, "m/s²", r2 > 0.95,
             f"RMSE on the half that was not fitted; it explains {r2:.1%} of the variance there; 95 % counts"),
        Item("fig. 2: some minutes of data suffice for c_b", "some minutes", rest, "min", rest <= 5.0,
             f"usable identification data from which c_b stays within 5 % of its value at {whole:.0f} min; up to 5 min counts"),
        Item("fig. 2: and give a small enough RMSE", "small", _rmse_at(brake, some), "m/s²",
             _rmse_at(brake, some) < 1.25 * brake.rmse,
             f"at {some:.1f} min; at {whole:.0f} min {brake.rmse:.4f}; up to a quarter more counts"),
        Item("fig. 3: T_r depends linearly on p_r", "justified", pedal.r2, "1", pedal.r2 > 0.99,
             "R² of the line; the simulated pedal map is linear, so this tests the method, not the claim. Real maps often bend"),
        Item("IV-A: c_b is the only relevant parameter for the estimation", "c_b", f"{changes['c_b']:.2%}", "",
             changes["c_b"] > 0.01, "change of the intentional jerk, rms, when c_b is 5 % larger: it multiplies p_b (1 − sigma), "
             "which is zero whenever it could count. Of the others: "
             + ", ".join(f"{name} {change:.1%}" for name, change in changes.items() if name != "c_b")),
        Item("IV-A: M is a known parameter", "known", f"{moved:+.1%}", "", None,
             "not in the paper: how far c_b moves when the mass is taken 5 % too large, by the paper's least squares; with a gain "
             f"of the accelerometer fitted beside it (for pitch) {with_gain / found['c_b'] - 1:+.1%}"),
    )  # fmt: skip
    words = (
        "c_b, kappa_1 and kappa_2 by least squares on signals low-passed at 5 Hz; the first half of the drive is fitted, the "
        "second validates. Shifts, standstill, slip and silent signals are left out; standard errors are honest for residuals "
        "that resemble their neighbours.",
    )
    charts = (validation_chart(brake), *learning_chart(brake), pedal_chart(pedal))
    return Chapter("Identification of c_b and c_r (IV-A)", words, (_values(brake, pedal.c_r, pedal.sd), *charts), items)


def _interval(fit: BrakeFit, name: str, factor: float) -> str:
    c = fit.coefficients[name]
    return f"95 % interval {c.low * factor:.4g} to {c.high * factor:.4g}"


def _values(fit: BrakeFit, c_r: float, c_r_sd: float) -> Table:
    rows = [
        ("c_b", "189 N/bar", f"{fit.coefficients['c_b'].value * 1e5:.2f}", f"{fit.coefficients['c_b'].sd * 1e5:.2f}"),
        (
            "kappa_1 − M d_a",
            "131 N",
            f"{fit.coefficients['kappa_1'].value:.1f}",
            f"{fit.coefficients['kappa_1'].sd:.1f}",
        ),
        ("kappa_2", "0.283 kg/m", f"{fit.coefficients['kappa_2'].value:.4f}", f"{fit.coefficients['kappa_2'].sd:.4f}"),
        ("c_r", "3.25 N m/%", f"{c_r / 100:.4f}", f"{c_r_sd / 100:.4f}"),
    ]
    return Table(("coefficient", "paper, and simulated car", "identified", "standard error"), tuple(rows))


def _minutes_to_rest(fit: BrakeFit) -> float:
    """Minutes of data from which c_b stays within the band around its final value; infinite if it never does."""
    final = fit.coefficients["c_b"].value
    outside = [not abs(point.value / final - 1) <= _BAND for point in fit.curve]
    last = max((k for k, out in enumerate(outside) if out), default=-1)
    return fit.curve[last + 1].minutes if last + 1 < len(fit.curve) else float("inf")


def _rmse_at(fit: BrakeFit, minutes: float) -> float:
    return next((p.rmse for p in fit.curve if p.minutes >= minutes and np.isfinite(p.rmse)), float("inf"))


def _sensitivity(driven: Driven, vehicle: Vehicle, intent: Estimate) -> dict[str, float]:
    """Change of the intentional jerk, rms over its rms, when one parameter is taken 5 % larger."""
    from codriver.observers import build

    jerk, valid = intent.columns["intentional_jerk"], intent.valid
    ell, preset = float(intent.provenance["ell"]), intent.provenance["preset"]
    changes = {}
    for letter, name in (
        ("c_b", "brake_coefficient"),
        ("c_r", "pedal_coefficient"),
        ("tau", "transmission"),
        ("M", "mass"),
    ):
        value = vehicle.parameters[name].value
        larger = tuple(_CHANGED * v for v in value) if isinstance(value, tuple) else _CHANGED * value
        wrong = vehicle.with_parameter(name, larger)
        observer = build("intent-pedals", wrong, dt=intent.grid.dt, ell=ell, preset=preset)
        other = compile(observer).run(driven.log, start=float(intent.time[0]), stop=float(intent.time[-1]))
        changes[letter] = rms((other.columns["intentional_jerk"] - jerk)[valid]) / rms(jerk[valid])
    return changes
