"""Plants: one a file; what observers are designed on."""

from codriver.models.alignment import AlignmentModel
from codriver.models.bicycle import BicycleMatrices, BicycleParameters, bicycle_lpv, bicycle_matrices, bicycle_model
from codriver.models.longitudinal import intention_model
from codriver.models.lpv import LPV, Polytope
from codriver.models.motorcycle import MotorcycleParameters, motorcycle_model
from codriver.models.single_track import SingleTrack
from codriver.models.state_space import StateSpace
from codriver.models.steer_row import SteerMotion, SteerRow
from codriver.models.steering import steering_model

__all__ = [
    "LPV",
    "AlignmentModel",
    "BicycleMatrices",
    "BicycleParameters",
    "MotorcycleParameters",
    "Polytope",
    "SingleTrack",
    "StateSpace",
    "SteerMotion",
    "SteerRow",
    "bicycle_lpv",
    "bicycle_matrices",
    "bicycle_model",
    "intention_model",
    "motorcycle_model",
    "steering_model",
]
