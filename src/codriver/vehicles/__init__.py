"""Vehicles: frozen parameters with unit, standard deviation and source, from TOML files."""

from codriver.vehicles.load import built_in_vehicles, load_vehicle
from codriver.vehicles.vehicle import Parameter, Vehicle

__all__ = ["Parameter", "Vehicle", "built_in_vehicles", "load_vehicle"]
