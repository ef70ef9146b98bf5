"""Estimators that look ahead: functions from a log to an estimate, never live and never exported."""

from codriver.offline.smoother import SmoothedEstimate, smooth

__all__ = ["SmoothedEstimate", "smooth"]
