"""The verdict: whether an estimate is to be trusted, and what speaks against it.

check.py          looks at an estimate and collects the findings
rows.py           what its innovations say, row by row (innovations.py)
sensors_agree.py  accelerometer against speed, pedals against standing still
steering.py       a steering wheel's encoder and the torques on its column
motorcycle*.py    a two-wheeler's sensors against each other: signs and units, bends, mounting, sensors that hang
"""

from codriver.finding import Finding
from codriver.trust.check import Check, check_estimate

__all__ = ["Check", "Finding", "check_estimate"]
