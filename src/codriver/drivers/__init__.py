"""How people drive: bursts of intentional jerk, distributions, a score of style, drivers beside each other.

threshold, bursts              what a burst is, and finding them
bands, pedal                   speed bands; reversals of the pedal
resampling, counts             intervals: block bootstrap, over-dispersed counts
course, position, alignment    the curvilinear coordinate, several drives on it
slopes                         whether drivers of one road find the same slope
style                          one driver in numbers
scale, population, scale_file  score and class; scales of a population; scales as files
doubts                         whether the data allow a judgement
compare                        several drivers
style_file                     the table of drivers as Parquet or CSV
"""

from codriver.drivers.alignment import Along, align, along
from codriver.drivers.bursts import Burst, Bursts, find_bursts
from codriver.drivers.compare import Comparison, Rank, compare_drivers
from codriver.drivers.course import Course, course_of
from codriver.drivers.population import make_scale
from codriver.drivers.scale import Rating, Scale, rate_style
from codriver.drivers.scale_file import default_scale, load_scale, save_scale
from codriver.drivers.slopes import Agreement, slope_agreement
from codriver.drivers.style import DriverStyle, describe_style
from codriver.drivers.style_file import save_styles
from codriver.drivers.threshold import Threshold, burst_threshold

__all__ = [
    "Agreement",
    "Along",
    "Burst",
    "Bursts",
    "Comparison",
    "Course",
    "DriverStyle",
    "Rank",
    "Rating",
    "Scale",
    "Threshold",
    "align",
    "along",
    "burst_threshold",
    "compare_drivers",
    "course_of",
    "default_scale",
    "describe_style",
    "find_bursts",
    "load_scale",
    "make_scale",
    "rate_style",
    "save_scale",
    "save_styles",
    "slope_agreement",
]
