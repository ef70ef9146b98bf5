"""A simulated car, driver, road and CAN bus, with the truth beside.

Its parameters are its own: an estimator never shares them, and may be wrong about the car.

    road, styles            where it goes, who drives
    plan, feet, driver      intention as bursts of jerk; pedals, imperfectly
    powertrain, car, drive  the motion, step by step, as a Trace
    truth                   what was true, as a Log
    sensors                 what the sensors make of it
    can_layout, network, bus   frames of a CAN bus, and files of them
    demo                    three minutes of all this
"""

from codriver.simulate.demo import DemoDrive, DemoFiles, demo_drive, write_demo
from codriver.simulate.drive import Trace, drive
from codriver.simulate.sensors import SensorParameters, measured_log
from codriver.simulate.truth import ideal_signals, truth_log

__all__ = [
    "DemoDrive",
    "DemoFiles",
    "SensorParameters",
    "Trace",
    "demo_drive",
    "drive",
    "ideal_signals",
    "measured_log",
    "truth_log",
    "write_demo",
]
