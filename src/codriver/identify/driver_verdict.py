"""What there is to say about the identification of a driver: what is told, how sure, and what was taken for granted.

    lags beyond = share of the autocorrelations of e, up to LAGS, outside +- 1.96 / sqrt(n)          0.05 if e is white
    explained = 1 - var(v) / var(T_dr)
    alike = rms(v) / rms(e)         v: torque left unexplained, e: what of it the past does not foretell (`driver_residual`)

A driver who is always the same leaves sensor noise, which is new each tick; one who varies leaves what lasts for seconds.
"""

from __future__ import annotations

import numpy as np

from codriver.finding import Finding
from codriver.identify.driver_residual import residual_of
from codriver.identify.driver_result import DriverFit
from codriver.identify.driver_signs import sign_findings
from codriver.identify.standard_errors import autocorrelation
from codriver.models.two_point_file import LETTERS
from codriver.signals.signal import Array

LAGS = 2.0  # s
WHITE = 0.1  # lags beyond
LASTING = 3.0  # alike
LEAST_EXPLAINED = 0.2  # explained


def error_correlation(fit: DriverFit) -> tuple[Array, Array, float]:
    """Lags, s, the autocorrelation of the errors one tick ahead, shapes (n,), and where 95 % of them lie if the errors are white.

    Args:
        fit: with a search's end.

    Raises:
        ValueError: nothing was sought.
    """
    if fit.found is None:
        raise ValueError("nothing was sought, so there are no errors")
    e = fit.found.errors
    most = round(LAGS / fit.tick)
    rho = autocorrelation(e, np.ones(e.size, bool), fit.found.pieces, most)
    return fit.tick * np.arange(1.0, most + 1), rho[1:], 1.96 / float(np.sqrt(e.size))


def lasting(fit: DriverFit) -> float:
    """alike."""
    v = np.concatenate(residual_of(fit.records, fit.best, ())(np.zeros(0)))
    return float(np.sqrt(np.mean(v**2))) / fit.one_step


def driver_findings(fit: DriverFit) -> tuple[Finding, ...]:
    """Judged sentences."""
    found = [
        _told(fit),
        *(f for d in fit.drives for f in d.findings()),
        *(f for r in fit.records for f in sign_findings(r)),
    ]
    if fit.explained < LEAST_EXPLAINED:
        found.append(
            Finding(
                "bad",
                f"{_share(fit.explained)}: do not trust the values; look at signs and units, and at what is given",
            )
        )
    if fit.found is None:
        return tuple(found)
    if not fit.settled:
        found.append(Finding("warn", f"{_unsettled(fit)}: do not trust the values, record more"))
    if fit.by == "dual-ekf":
        said = "standard errors are the dual filter's own: they hold what its tuning assumes, and a driver who varies biases it"
        found.append(Finding("warn", f"{said}; compare with the way by the road"))
    else:
        found.append(_variation(fit))
    found.append(_white(fit))
    found += [
        Finding(
            "warn",
            f"the torque is no sensor's ({source}): the estimate's lag and errors bias what is found",
        )
        for source in sorted(set(fit.estimated))
    ]
    if any(r.summed for r in fit.records):
        found.append(Finding("warn", "offset and heading error are summed from yaw rate and sideslip, behind a high-pass: slow "
                                     "corrections do not count"))  # fmt: skip
    given = ", ".join(f"{LETTERS[n][0]} {x:g} {LETTERS[n][1]}".removesuffix(" 1") for n, x in fit.given.items())
    found.append(Finding("ok", f"taken as given: {given}; the standard errors hold no doubt about these"))
    if "far" in fit.given and fit.by != "dual-ekf":
        said = "where he looks is given: a far point that is a tenth off can halve K_c and T_I and double tau_p"
        found.append(Finding("warn", f"{said}; seek near and far, too"))
    return tuple(found)


def _told(fit: DriverFit) -> Finding:
    told = ", ".join(p.letter for p in fit.parameters.values())
    lacking = ", ".join(LETTERS[r.name][0] for r in fit.refused)
    drives = "the drive tells" if len(fit.drives) == 1 else "the drives tell"
    if not lacking:
        return Finding("ok", f"{drives} all that was asked for: {told}")
    if not told:
        return Finding("bad", f"{drives} none of {lacking}; record more, with more curves")
    return Finding("warn", f"{drives} {told}, not {lacking}; more minutes, curves or speeds tell more")


def _share(explained: float) -> str:
    if explained <= 0:
        return "the driver found explains less of the torque than a constant would"
    return f"the driver found explains {explained:.1%} of the torque"


def _unsettled(fit: DriverFit) -> str:
    if fit.by == "dual-ekf":
        return "the dual filter's parameters still move at the end of the drive"
    return "the search did not come to rest"


def _variation(fit: DriverFit) -> Finding:
    alike = lasting(fit)
    left = f"{fit.rms:.2g} N m of the torque are left unexplained"
    if alike < LASTING:
        return Finding("ok", f"{left}, new at each tick: noise, and a driver who is always the same")
    if fit.by == "direct":
        return Finding(
            "warn",
            f"{left}, and they last: he varies, which biases prediction errors, or what is given is not his; try by road",
        )
    return Finding(
        "ok",
        f"{left}, and they last: he varies (what the road makes of his torque is fitted), or what is given is not his",
    )


def _white(fit: DriverFit) -> Finding:
    lags, rho, bound = error_correlation(fit)
    beyond = float(np.mean(np.abs(rho) > bound))
    said = f"errors one tick ahead: {beyond:.0%} of the autocorrelations up to {lags[-1]:g} s beyond the bounds of white noise"
    if beyond <= WHITE:
        return Finding("ok", said)
    held = (
        "the standard errors do not hold that" if fit.by == "dual-ekf" else "the standard errors hold that (Newey-West)"
    )
    return Finding("warn", f"{said}; {held}")
