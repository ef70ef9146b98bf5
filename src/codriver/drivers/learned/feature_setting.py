"""Which features a learned driver sees: the vector z of 2019 eq. (1), with what is honest to know.

    z_k = [x_i(t_k), x_i(t_k - dt), ..., x_i(t_k - (ell - 1) dt),  c_j(t_k + h),  rho ahead]      target: T(t_k + h)

t_k is now: the newest moment anything was measured. x_i are signals of the past, the torque among them; rho ahead is the road's
curvature at the places the vehicle will reach at its present speed, which a map or a camera knows. c_j are signals at the moment
of the target itself. A driver cannot be foreseen from what he has not done yet: the vehicle's states at t_k + h are effects of the
torque that is asked for, so c_j is empty unless the paper's own protocol is asked for. There h = dt, and z is (1): ell = 5 gives
4 (ell + 1) + ell = 29 features.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, Self

from codriver.errors import UsageError
from codriver.names import AHEAD

TARGETS = ("driver_torque", "steering_wheel_torque")  # the first that a log has is learnt
STATES = ("road_curvature", "sideslip_angle", "yaw_rate", "steering_wheel_angle")  # of eq. (1), in its order
_SMOOTHINGS = ("none", "causal", "paper2019")


@dataclass(frozen=True)
class FeatureSetting:
    """Which features.

    Attributes:
        dt: between the moments of the history, s.
        history: ell, moments of the past, the newest included.
        horizon: h, how far ahead the torque is foretold, s.
        substeps: ticks in dt; signals are sampled, filtered and, with `dense`, rows taken at each.
        dense: a row at every tick, not only at every dt: more rows of the same drive to learn from.
        past: signals with a history; those the log lacks are left out.
        slow: signals of which only the newest value counts.
        current: signals taken at the moment of the target too. They leak.
        preview: how far ahead of now the road is known, s at the present speed; at 0 and every dt.
        smoothing: "none"; "causal", a first-order low-pass; "paper2019", that and a local quadratic that sees the future.
        cutoff: of the low-pass, rad/s.
        span: of the local quadratic, s.
        smooth_target: whether the torque that is to be foretold is smoothed too.
        slowest: rows at which the vehicle is slower are left out, m/s.
    """

    dt: float = 0.2
    history: int = 5
    horizon: float = 0.2
    substeps: int = 2
    dense: bool = True
    past: tuple[str, ...] = (
        "steering_wheel_angle",
        "yaw_rate",
        "sideslip_angle",
        "lateral_acceleration",
        "road_curvature",
    )
    slow: tuple[str, ...] = ("longitudinal_speed",)
    current: tuple[str, ...] = ()
    preview: float = 1.6
    smoothing: str = "none"
    cutoff: float = 15.0
    span: float = 1.0
    smooth_target: bool = False
    slowest: float = 1.0

    def __post_init__(self) -> None:
        for name in ("dt", "horizon", "cutoff", "span"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise UsageError(f"{name} = {value:g}", "a positive number", "choose another")
        if self.history < 2 or self.substeps < 1:
            raise UsageError(
                f"history {self.history}, substeps {self.substeps}", "a history of 2 or more, substeps of 1 or more",
                "choose others",
            )  # fmt: skip
        if self.smoothing not in _SMOOTHINGS:
            raise UsageError(f"smoothing '{self.smoothing}'", f"one of {', '.join(_SMOOTHINGS)}", "choose one")
        if abs(self.horizon / self.tick - self.ahead) > 1e-6 or self.ahead < 1:
            raise UsageError(
                f"a horizon of {self.horizon:g} s with ticks of {self.tick:g} s", "a whole number of ticks",
                f"choose a multiple of {self.tick:g} s, or other substeps",
            )  # fmt: skip
        if not 0 <= self.preview <= AHEAD * self.dt + 1e-9:
            raise UsageError(f"a preview of {self.preview:g} s", f"0 to {AHEAD * self.dt:g} s", "choose another")

    @property
    def tick(self) -> float:
        """Between rows, s: dt / substeps."""
        return self.dt / self.substeps

    @property
    def ahead(self) -> int:
        """The horizon in ticks."""
        return round(self.horizon / self.tick)

    @property
    def previews(self) -> tuple[float, ...]:
        """How far ahead of now the road is looked at, s."""
        return tuple(k * self.dt for k in range(1, int(self.preview / self.dt + 1e-9) + 1))

    @property
    def leaks(self) -> tuple[str, ...]:
        """Why figures got with these features would flatter, one sentence each; empty when they would not."""
        found = []
        if self.current:
            found.append(
                f"the features hold {', '.join(n for n in self.current if n != 'road_curvature') or 'signals'} at the very moment "
                "of the torque asked for: effects of it, so the task is mostly inverse dynamics"
            )
        if self.smoothing == "paper2019":
            found.append("the local quadratic that smooths the signals sees the future of each moment")
        if self.smooth_target:
            found.append("the torque that is foretold is itself smoothed: the smoother knows part of the answer")
        return tuple(found)

    def as_plain(self) -> dict[str, Any]:
        """Settings as numbers, texts and lists, for a file."""
        return {name: list(v) if isinstance(v, tuple) else v for name, v in vars(self).items()}

    @classmethod
    def from_plain(cls, plain: dict[str, Any]) -> Self:
        """From `as_plain`.

        Raises:
            UsageError: a setting is unknown or wrong.
        """
        unknown = sorted(set(plain) - set(cls.__dataclass_fields__))
        if unknown:
            raise UsageError(f"settings {unknown}", "settings this version knows", "use a newer version")
        settings: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in plain.items()}
        return cls(**settings)


HONEST = FeatureSetting()
PAPER2019 = FeatureSetting(
    substeps=10, dense=False, past=STATES, slow=(), current=STATES, preview=0.0, smoothing="paper2019", cutoff=2.5,
    smooth_target=True, slowest=0.0,
)  # fmt: skip
PRESETS = {"honest": HONEST, "paper2019": PAPER2019}
