"""A vehicle: frozen parameters, each with unit, standard deviation and source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codriver.errors import VehicleError
from codriver.names import nearest


@dataclass(frozen=True)
class Parameter:
    """One parameter in SI units.

    Attributes:
        name: from the table in `codriver.vehicles.load`.
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

    def with_parameter(self, name: str, value: float | tuple[float, ...], source: str = "changed in memory") -> Vehicle:
        """A vehicle with one parameter's value replaced, in SI units."""
        old = self._get(name)
        new = Parameter(name, value, old.unit, None, source)
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
