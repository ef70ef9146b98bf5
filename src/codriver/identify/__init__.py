"""Coefficients of a vehicle from its own drives, and whether a vehicle file fits a drive."""

from codriver.identify.alignment import identify_alignment
from codriver.identify.alignment_result import AlignmentCoefficient, AlignmentFit
from codriver.identify.alignment_stiffness import StiffnessFit, identify_alignment_stiffness
from codriver.identify.brake import identify_brake
from codriver.identify.brake_fit import BrakeFit, Coefficient, Refusal
from codriver.identify.check_log import check_vehicle_against_log
from codriver.identify.driver_fit import identify_driver
from codriver.identify.driver_result import DriverFit, DriverParameter
from codriver.identify.learning import LearningPoint
from codriver.identify.pedal import PedalFit, identify_pedal
from codriver.identify.ratio import GearRatio, RatioFit, identify_ratio
from codriver.identify.steer_row_fit import SteerRecord, SteerRowFit, fit_steer_row, steer_record
from codriver.identify.steer_zero import find_steer_zero
from codriver.identify.steering_result import SteeringFit
from codriver.identify.steering_wheel import identify_steering_wheel
from codriver.identify.torque_scale import TorqueScale, identify_torque_scale

__all__ = [
    "AlignmentCoefficient",
    "AlignmentFit",
    "BrakeFit",
    "Coefficient",
    "DriverFit",
    "DriverParameter",
    "GearRatio",
    "LearningPoint",
    "PedalFit",
    "RatioFit",
    "Refusal",
    "SteerRecord",
    "SteerRowFit",
    "SteeringFit",
    "StiffnessFit",
    "TorqueScale",
    "check_vehicle_against_log",
    "find_steer_zero",
    "fit_steer_row",
    "identify_alignment",
    "identify_alignment_stiffness",
    "identify_brake",
    "identify_driver",
    "identify_pedal",
    "identify_ratio",
    "identify_steering_wheel",
    "identify_torque_scale",
    "steer_record",
]
