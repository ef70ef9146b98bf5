"""A nonlinear motorcycle to hold observers against: any lean, toroidal tyres that saturate, own speed.

parameters      what it has beyond Sharp's letters
tyre            magic formula with camber
kinematics      frames, wheels, contacts
machine         equations of motion
"""

from codriver.simulate.motorcycle.machine import INPUTS, OUTPUTS, STATES, Machine
from codriver.simulate.motorcycle.parameters import FRONT_TYRE, REAR_TYRE, MachineParameters, TyreParameters

__all__ = ["FRONT_TYRE", "INPUTS", "OUTPUTS", "REAR_TYRE", "STATES", "Machine", "MachineParameters", "TyreParameters"]
