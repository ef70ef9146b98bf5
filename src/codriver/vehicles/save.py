"""Write a vehicle file, in SI units, such that loading it gives the same vehicle."""

from __future__ import annotations

from pathlib import Path

from codriver.errors import VehicleError
from codriver.toml_file import quoted
from codriver.vehicles.load import parse_vehicle
from codriver.vehicles.vehicle import Parameter, Vehicle
from codriver.whole_file import write_text


def save_vehicle(vehicle: Vehicle, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a vehicle file that `load_vehicle` reads; the file appears under its name only when it is complete.

    Args:
        vehicle: what to write.
        path: a .toml file.
        overwrite: replace a file that is there.

    Raises:
        VehicleError: the file is there already or cannot be written, or the vehicle would not be loaded again (a value
            out of bounds, a standard deviation too few); nothing is written then.
    """
    path = Path(path)
    if path.suffix != ".toml":
        raise VehicleError(f"cannot write a vehicle to '{path.name}'", "a name ending in .toml", "choose such a name")
    if path.exists() and not overwrite:
        raise VehicleError(
            f"{path} is there already", "the name of a new file", "choose another name, or say overwrite=True"
        )
    text = _text(vehicle)
    if parse_vehicle(text, f"the file of '{vehicle.name}'") != vehicle:
        raise VehicleError(
            f"the file of '{vehicle.name}' would be read as another vehicle",
            "parameters in the units of codriver.vehicles.KNOWN",
            "make parameters with Vehicle.with_parameter",
        )
    try:
        write_text(path, text)
    except OSError as error:
        raise VehicleError(
            f"cannot write {path}: {error.strerror or error}", "a folder you may write into", "choose another folder"
        ) from None
    return path


def _text(vehicle: Vehicle) -> str:
    """The text of a vehicle's file."""
    head = f"name = {quoted(vehicle.name)}\ntitle = {quoted(vehicle.title)}\nsource = {quoted(vehicle.source)}\n"
    return head + "".join(_table(parameter) for parameter in vehicle.parameters.values())


def _table(parameter: Parameter) -> str:
    """One parameter's table."""
    lines = [f"[{parameter.name}]", f"value = {_number(parameter.value)}", f"unit = {quoted(parameter.unit)}"]
    if parameter.sd is not None:
        lines.append(f"sd = {_number(parameter.sd)}")
    lines.append(f"source = {quoted(parameter.source)}")
    return "\n" + "\n".join(lines) + "\n"


def _number(value: float | tuple[float, ...]) -> str:
    """A number or list of numbers with all their digits."""
    return f"[{', '.join(map(_number, value))}]" if isinstance(value, tuple) else repr(float(value))
