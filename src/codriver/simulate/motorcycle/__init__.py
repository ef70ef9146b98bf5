"""A nonlinear motorcycle to hold observers against: any lean, toroidal tyres that saturate, own speed.

parameters      what it has beyond Sharp's letters
tyre            magic formula with camber
kinematics      frames, wheels, contacts
machine         equations of motion
rider, paths    who rides it, and where
ride            a ride, with the truth
sensors         what sensors make of it
"""

from codriver.simulate.motorcycle.machine import INPUTS, OUTPUTS, STATES, Machine
from codriver.simulate.motorcycle.parameters import FRONT_TYRE, REAR_TYRE, MachineParameters, TyreParameters
from codriver.simulate.motorcycle.paths import double_lane_change, ramp, slalom
from codriver.simulate.motorcycle.ride import Ride, ride
from codriver.simulate.motorcycle.rider import Rider
from codriver.simulate.motorcycle.sensors import IDEAL, SENSED, RideSensors, relative_noise, sense

__all__ = [
    "FRONT_TYRE",
    "IDEAL",
    "INPUTS",
    "OUTPUTS",
    "REAR_TYRE",
    "SENSED",
    "STATES",
    "Machine",
    "MachineParameters",
    "Ride",
    "RideSensors",
    "Rider",
    "TyreParameters",
    "double_lane_change",
    "ramp",
    "relative_noise",
    "ride",
    "sense",
    "slalom",
]
