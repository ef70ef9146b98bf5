"""An assist motor on the column: what it is asked for, and what of that it gives.

    present      asked = g T                                          power steering: the driver's torque as his sensor has it
    predicted    asked = g T^(t + h)                                  what a driver model says now that he will pull in h s
    path         asked = g K e,   e = L bend(s, L) - y - L (psi + beta) - L^2 r / (2 v),   L = v t_p
    none         asked = 0

    T_a: asked times alpha, held within the limit, through 1 / (tau s + 1), no quicker than the rate

e, m: how far to the left the path will be in t_p s from where the car would be if it went on turning as it does; 0 on the path in a
steady turn. bend: `models.road_sight`. The letters of the rest are those of `circuit`.

The authority alpha, 0 to 1, is taken back where the driver does not agree, and given back slowly:

    opposed = min(|T|, |asked|) where T asked < 0, else 0      he pulls against what is asked for           N m
    doubt = |T - T^ made h s ago| / sd                         he does not do what was foretold             -

each through 1 / (0.2 s + 1); alpha falls from 1 to 0 between two values of each.

That the force is shared, and the driver can always overrule it, is haptic shared control: Abbink, Mulder, Boer 2012, "Haptic shared
control: smoothly shifting control authority?", doi:10.1007/s10111-011-0192-5. Guidance by an error some time ahead: Mulder, Abbink,
Boer 2012, "Sharing control with haptics: seamless driver support from manual to automatic control",
doi:10.1177/0018720812443984. An assist that a learned driver model commands is what Okamoto, Tsiotras 2019 (Robotics and Autonomous
Systems) have their models for. Laws, numbers and the fading here are this project's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, inf, isfinite
from typing import NamedTuple

from codriver.errors import UsageError

KINDS = ("none", "present", "predicted", "path")


@dataclass(frozen=True)
class Fade:
    """When authority is taken back.

    Attributes:
        opposed: N m of the driver against what is asked for at which that begins, and at which nothing is left.
        doubt: standard deviations off what was foretold, likewise.
        seen: s over which either is looked at.
        quick, slow: time constants of taking and giving back, s.
    """

    opposed: tuple[float, float] = (0.5, 1.5)
    doubt: tuple[float, float] = (3.0, 6.0)
    seen: float = 0.2
    quick: float = 0.1
    slow: float = 1.0

    def __post_init__(self) -> None:
        for name in ("opposed", "doubt"):
            low, high = getattr(self, name)
            if not 0 <= low < high:
                raise UsageError(
                    f"{name} from {low:g} to {high:g}", "two values, the second larger", "change the setting"
                )
        if min(self.seen, self.quick, self.slow) <= 0:
            raise UsageError("a time constant that is not positive", "positive ones", "change the setting")


@dataclass(frozen=True)
class Assist:
    """An assist.

    Attributes:
        kind: of KINDS.
        gain: g, the level of authority.
        stiffness, ahead: K, N m/m, and t_p, s, of "path".
        lag: tau, s; 0 for none.
        limit: N m; rate: N m/s.
        fade: None: authority stays.

    Raises:
        UsageError: no such kind, or a number that cannot be.
    """

    kind: str = "none"
    gain: float = 1.0
    stiffness: float = 2.0
    ahead: float = 0.7
    lag: float = 0.1
    limit: float = 5.0
    rate: float = 40.0
    fade: Fade | None = field(default_factory=Fade)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise UsageError(f"assist '{self.kind}'", f"one of {', '.join(KINDS)}", "choose one of these")
        for name in ("gain", "stiffness", "ahead", "lag", "limit", "rate"):
            value = getattr(self, name)
            if value < 0 or not (isfinite(value) or name in ("limit", "rate")):
                raise UsageError(f"an assist whose {name} is {value:g}", "0 or more", "change the setting")
        if self.ahead == 0:
            raise UsageError("an assist that looks 0 s ahead", "a positive time", "change the setting")


class Foretold(NamedTuple):
    """Of a driver model: the torque to come and its sd, N m, and what it said h s ago of now; NaN where not known."""

    torque: float
    sd: float
    of_now: float


UNKNOWN = Foretold(float("nan"), float("nan"), float("nan"))


class AssistState(NamedTuple):
    """Carried from tick to tick: the lag's output and the motor's torque, N m; authority; opposition, N m; doubt."""

    lagged: float = 0.0
    torque: float = 0.0
    authority: float = 1.0
    opposed: float = 0.0
    doubt: float = 0.0


def advance(
    assist: Assist, state: AssistState, dt: float, torque: float, error: float, foretold: Foretold = UNKNOWN
) -> AssistState:
    """One tick; the motor's torque is `torque` of what is returned.

    What is not foretold yet asks for nothing, and raises no doubt.

    Args:
        assist: the setting.
        state: of the tick before.
        dt: s.
        torque: of the driver, N m, as measured.
        error: e, m.
        foretold: by the driver model.
    """
    a, known = assist, isfinite(foretold.torque)
    asked = {"present": torque, "predicted": foretold.torque if known else 0.0, "path": a.stiffness * error}
    wanted = a.gain * asked.get(a.kind, 0.0)
    authority, opposed, doubt = state.authority, state.opposed, state.doubt
    if a.fade is not None:
        authority, opposed, doubt = _authority(a.fade, state, dt, torque, wanted, foretold)
    held = max(-a.limit, min(a.limit, authority * wanted))
    lagged = held + (state.lagged - held) * (exp(-dt / a.lag) if a.lag > 0 else 0.0)
    step = a.rate * dt if a.rate < inf else inf
    given = max(state.torque - step, min(state.torque + step, lagged))
    return AssistState(lagged, given, authority, opposed, doubt)


def _authority(
    fade: Fade, state: AssistState, dt: float, torque: float, wanted: float, foretold: Foretold
) -> tuple[float, float, float]:
    """Authority, and what it is drawn from."""
    keep = exp(-dt / fade.seen)
    against = min(abs(torque), abs(wanted)) if torque * wanted < 0 else 0.0
    off = abs(torque - foretold.of_now) / foretold.sd if foretold.sd > 0 and isfinite(foretold.of_now) else 0.0
    opposed = keep * state.opposed + (1 - keep) * against
    doubt = keep * state.doubt + (1 - keep) * off
    target = min(_left(opposed, fade.opposed), _left(doubt, fade.doubt))
    time = fade.quick if target < state.authority else fade.slow
    return target + (state.authority - target) * exp(-dt / time), opposed, doubt


def _left(value: float, between: tuple[float, float]) -> float:
    """1 below the first, 0 beyond the second, straight in between."""
    low, high = between
    return max(0.0, min(1.0, (high - value) / (high - low)))
