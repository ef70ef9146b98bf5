"""A simulated car, driver, road and CAN bus, with the truth beside.

Its parameters are its own: an estimator never shares them, and may be wrong about the car.

    road, styles            where it goes, who drives
    plan, feet, driver      intention as bursts of jerk; pedals, imperfectly
    powertrain, car, drive  the motion, step by step, as a Trace
    truth                   what was true, as a Log
    sensors                 what the sensors make of it
    can_layout, network, bus   frames of a CAN bus, and files of them
    odometer                wheel speeds from teeth
    demo                    three minutes of all this
    route, track            a road of 53 km with named stretches, and a closed track
    road_test               42 minutes, and two laps, of all this
    folder, drive_files     files, written whole or not at all
    steering                a steering wheel that its motor turns
    motorcycle              a nonlinear motorcycle, its rider and sensors
"""

from codriver.simulate.bus import BusParameters, Hole, drop_outs
from codriver.simulate.car_parameters import CAR_2015, PRINTED_2015, ROLLING_RADIUS_2015, CarParameters
from codriver.simulate.demo import DemoDrive, DemoFiles, demo_drive, write_demo
from codriver.simulate.drive import Trace, drive
from codriver.simulate.drive_files import DriveFiles, nominal_2015, write_drive
from codriver.simulate.folder import refuse_foreign
from codriver.simulate.road_test import ROAD_TEST_SENSORS, RoadTest, road_test, track_test
from codriver.simulate.route import ROAD_TEST_STRETCHES, Stretch, road_test_road
from codriver.simulate.sensors import PEDAL_NOISE_LEVELS, SensorParameters, measured_log
from codriver.simulate.steering import SETTINGS, Wheel, WheelNoise, WheelRuns, WheelSetting, simulate_wheel
from codriver.simulate.styles import STYLES, Style
from codriver.simulate.track import track_road
from codriver.simulate.truth import ideal_signals, truth_log

__all__ = [
    "CAR_2015",
    "PEDAL_NOISE_LEVELS",
    "PRINTED_2015",
    "ROAD_TEST_SENSORS",
    "ROAD_TEST_STRETCHES",
    "ROLLING_RADIUS_2015",
    "SETTINGS",
    "STYLES",
    "BusParameters",
    "CarParameters",
    "DemoDrive",
    "DemoFiles",
    "DriveFiles",
    "Hole",
    "RoadTest",
    "SensorParameters",
    "Stretch",
    "Style",
    "Trace",
    "Wheel",
    "WheelNoise",
    "WheelRuns",
    "WheelSetting",
    "demo_drive",
    "drive",
    "drop_outs",
    "ideal_signals",
    "measured_log",
    "nominal_2015",
    "refuse_foreign",
    "road_test",
    "road_test_road",
    "simulate_wheel",
    "track_road",
    "track_test",
    "truth_log",
    "write_demo",
    "write_drive",
]
