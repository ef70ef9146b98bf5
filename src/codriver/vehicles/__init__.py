"""Vehicles: frozen parameters with unit, standard deviation and source, from TOML files."""

from codriver.vehicles.known import KNOWN, Known
from codriver.vehicles.load import built_in_vehicles, load_vehicle
from codriver.vehicles.save import save_vehicle
from codriver.vehicles.vehicle import Parameter, Vehicle

__all__ = ["KNOWN", "Known", "Parameter", "Vehicle", "built_in_vehicles", "load_vehicle", "save_vehicle"]
