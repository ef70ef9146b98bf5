"""A nonlinear motorcycle to hold observers against: any lean, toroidal tyres that saturate, own speed.

parameters      what it has beyond Sharp's letters
masses          what is left of a body without its parts
tyre            magic formula with camber
kinematics      frames, wheels, contacts
motion, forces  equations of motion
machine         all of these, compiled
course, paths   where it is ridden, and how fast
rider           who rides it; rider_law: how he leans it
ride            a ride, with the truth
sensors         what sensors make of it
scenarios       the rides of the 2018 paper; variations: other riders and tyres
files           a ride as the files of a logger
"""

from codriver.simulate.motorcycle.course import Course, by_curvature, by_place
from codriver.simulate.motorcycle.machine import INPUTS, OUTPUTS, STATES, Machine
from codriver.simulate.motorcycle.parameters import (
    FRONT_TYRE,
    REAR_TYRE,
    MachineParameters,
    Suspension,
    TyreParameters,
    UpperBody,
)
from codriver.simulate.motorcycle.paths import closed, double_lane_change, for_bends, ramp, slalom, straight
from codriver.simulate.motorcycle.ride import Ride, ride
from codriver.simulate.motorcycle.rider import Rider
from codriver.simulate.motorcycle.scenarios import SCENARIOS, RideRecord, RideSetting, nominal_machine, simulate_ride
from codriver.simulate.motorcycle.sensors import IDEAL, SENSED, RideSensors, relative_noise, sense
from codriver.simulate.motorcycle.variations import with_rider, with_tyres

__all__ = [
    "FRONT_TYRE",
    "IDEAL",
    "INPUTS",
    "OUTPUTS",
    "REAR_TYRE",
    "SCENARIOS",
    "SENSED",
    "STATES",
    "Course",
    "Machine",
    "MachineParameters",
    "Ride",
    "RideRecord",
    "RideSensors",
    "RideSetting",
    "Rider",
    "Suspension",
    "TyreParameters",
    "UpperBody",
    "by_curvature",
    "by_place",
    "closed",
    "double_lane_change",
    "for_bends",
    "nominal_machine",
    "ramp",
    "relative_noise",
    "ride",
    "sense",
    "simulate_ride",
    "slalom",
    "straight",
    "with_rider",
    "with_tyres",
]
