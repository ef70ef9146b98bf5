"""Estimators that look ahead: functions from a log to an estimate, never live and never exported."""

from codriver.offline.smoothed import SmoothedEstimate
from codriver.offline.smoother import smooth

__all__ = ["SmoothedEstimate", "smooth"]
