"""How a driver steers, learned from drives: the torque to come, with a band (2019, sections 2 and 5).

feature_setting, features, road_ahead, smoothing, scaling    the vector z of eq. (1) from a log
regressor, kinds                                             what a model is; the models by name, one a file
protocol, evaluate                                           what is held out; tables with the baselines in them
calibration                                                  bands that hold what they promise
learned_driver, driver_file                                  a driver as a value, and as a file
horizon, rollout                                             error against horizon, direct or iterated through a vehicle
recognise                                                    which of several drivers is this?
driver_observer                                              a driver as an Observer: batch, live, C
"""

from codriver.drivers.learned.driver_file import load_driver, save_driver
from codriver.drivers.learned.driver_observer import observer_of
from codriver.drivers.learned.evaluate import Evaluation, Score, evaluate, evaluate_table
from codriver.drivers.learned.feature_setting import FeatureSetting
from codriver.drivers.learned.features import FeatureTable, features_of
from codriver.drivers.learned.horizon import error_against_horizon
from codriver.drivers.learned.horizon_errors import HorizonErrors
from codriver.drivers.learned.kinds import BASELINES, DEFAULT, KINDS, class_of, regressor_of
from codriver.drivers.learned.learned_driver import LearnedDriver, TorquePrediction, fit_driver, fit_table
from codriver.drivers.learned.prepare import prepared
from codriver.drivers.learned.protocol import PROTOCOLS, Protocol, folds_of
from codriver.drivers.learned.recognise import Likeness, recognise
from codriver.drivers.learned.regressor import TorqueRegressor

__all__ = [
    "BASELINES",
    "DEFAULT",
    "KINDS",
    "PROTOCOLS",
    "Evaluation",
    "FeatureSetting",
    "FeatureTable",
    "HorizonErrors",
    "LearnedDriver",
    "Likeness",
    "Protocol",
    "Score",
    "TorquePrediction",
    "TorqueRegressor",
    "class_of",
    "error_against_horizon",
    "evaluate",
    "evaluate_table",
    "features_of",
    "fit_driver",
    "fit_table",
    "folds_of",
    "load_driver",
    "observer_of",
    "prepared",
    "recognise",
    "regressor_of",
    "save_driver",
]
