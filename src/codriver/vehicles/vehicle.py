"""A vehicle: frozen parameters, each with unit, standard deviation and source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codriver.errors import VehicleError
from codriver.names import nearest
from codriver.vehicles.known import KNOWN


@dataclass(frozen=True)
class Parameter:
    """One parameter in SI units.

    Attributes:
        name: from the table in `codriver.vehicles.known`.
        value: one number, or one per gear.
        unit: SI unit.
        sd: standard deviation in the same unit, one number or one per gear; None where nobody gave one.
        source: where the number comes from.
    """

    name: str
    value: float | tuple[float, ...]
    unit: str
    sd: float | tuple[float, ...] | None
    source: str


@dataclass(frozen=True)
class Vehicle:
    """A vehicle's parameters.

    Attributes:
        name: short name, as in `--vehicle NAME`.
        title: what it is, for people.
        source: the paper or test campaign, with DOI where there is one.
        parameters: by name.
    """

    name: str
    title: str
    source: str
    parameters: Mapping[str, Parameter]

    def number(self, name: str) -> float:
        """The value of a parameter that is one number, in SI units.

        Raises:
            VehicleError: the vehicle lacks the parameter, or it has one value per gear.
        """
        value = self._get(name).value
        if isinstance(value, tuple):
            raise VehicleError(
                f"vehicle '{self.name}': parameter '{name}' has {len(value)} values",
                "one number",
                "see docs/vehicles.md",
            )
        return value

    def numbers(self, name: str) -> tuple[float, ...]:
        """The values of a parameter that has one per gear (a single number counts as one gear), in SI units.

        Raises:
            VehicleError: the vehicle lacks the parameter.
        """
        value = self._get(name).value
        return value if isinstance(value, tuple) else (value,)

    def __contains__(self, name: str) -> bool:
        return name in self.parameters

    def with_parameter(
        self,
        name: str,
        value: float | Sequence[float],
        sd: float | Sequence[float] | None = None,
        source: str = "changed in memory",
    ) -> Vehicle:
        """A vehicle that has this parameter with this value, instead of its own or in addition.

        Args:
            name: a parameter of `codriver.vehicles.known`.
            value: in SI units, one number or one per gear; bounds are checked when a vehicle is saved or loaded, so that
                odd values can be tried.
            sd: its standard deviation, in the same unit; None if nobody knows. That of the old value is not kept.
            source: where the number comes from.

        Raises:
            VehicleError: no vehicle has such a parameter.
        """
        if name not in KNOWN:
            near = nearest(name, KNOWN)
            raise VehicleError(
                f"'{name}' is not a parameter",
                "a parameter of the list in docs/vehicles.md",
                f"did you mean {near}?" if near else "see docs/vehicles.md for the list",
            )
        new = Parameter(name, _numbers(value), KNOWN[name].unit, None if sd is None else _numbers(sd), source)
        return Vehicle(self.name, self.title, self.source, {**self.parameters, name: new})

    def _get(self, name: str) -> Parameter:
        try:
            return self.parameters[name]
        except KeyError:
            near = nearest(name, self.parameters)
            raise VehicleError(
                f"vehicle '{self.name}' has no parameter '{name}'",
                f"it among: {', '.join(sorted(self.parameters))}" + (f"; did you mean {near}?" if near else ""),
                f"add a table [{name}] with value, unit and source to the vehicle file, or use an estimator that does without it",
            ) from None


def _numbers(given: float | Sequence[float]) -> float | tuple[float, ...]:
    """One number, or several as a tuple, which cannot be changed."""
    return float(given) if isinstance(given, (int, float)) else tuple(float(number) for number in given)
